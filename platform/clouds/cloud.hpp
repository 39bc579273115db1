// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is read from a file of a point cloud, whatever its format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "posix/outcome.hpp"

namespace tessera {

inline constexpr std::uint64_t kMostCloudPoints = std::uint64_t{1} << 24U;
inline constexpr std::uint64_t kMostCloudFileBytes = std::uint64_t{2} << 30U;
/// Of a point that is read: in Cloud, and in the ScanBuffer that it is copied to.
inline constexpr std::uint64_t kScanPointBytes = 24 + 17;
/// Of the text before the points.
inline constexpr std::size_t kMostCloudHeaderBytes = std::size_t{1} << 16U;

/// What a file's header says, checked against the file's size: points that the file cannot hold are
/// refused before there is memory for them.
struct CloudSummary {
  std::size_t points = 0;
  bool has_labels = false;     ///< A field label, class or semantic.
  bool has_viewpoint = false;  ///< Another one than the identity (PCD).
};

/// The points of a file. Read into again and again, so that its memory is kept.
struct Cloud {
  std::vector<float> points_xyzi;     ///< Metres, sensor frame, as stored; intensity 0 without one.
  std::vector<std::int64_t> raw_ids;  ///< One a point, or none at all.

  [[nodiscard]] std::size_t num_points() const noexcept { return points_xyzi.size() / 4; }
};

/// The whole of a file and its name, for messages.
struct CloudBytes {
  std::string_view path;
  std::string_view bytes;
  bool with_labels = true;  ///< Without, fields of labels are passed over, whatever is in them.
};

/// What a message quotes of a file: 32 bytes at most, what is not printable ASCII as '?', as a file
/// of another kind has anything in it.
[[nodiscard]] std::string quoted(std::string_view text);
/// "path: what; remedy", in one line whatever is quoted.
[[nodiscard]] Failure cloud_failure(std::string_view path, std::string_view what,
                                    std::string_view remedy);
/// A count of points that no scan may have.
[[nodiscard]] Failure too_many_points(std::string_view path, std::uint64_t points);

/// The first bytes of a file, enough for its header, and how many it has in all.
struct CloudHead {
  std::string path;
  std::string bytes;
  std::uint64_t file_bytes = 0;
};

/// Fails as InputFile does, and with kUsage iff the file is over kMostCloudFileBytes.
Outcome<CloudHead> read_cloud_head(const std::string& path);
/// The whole file. Fails as read_cloud_head().
Outcome<std::string> read_cloud_bytes(const std::string& path);

}  // namespace tessera
