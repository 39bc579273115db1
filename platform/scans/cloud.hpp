// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The content of a point cloud file, independent of its format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"

namespace tessera {

/// Of a point in memory and in KITTI's files: x, y, z, intensity.
inline constexpr std::size_t kFloatsPerPoint = 4;
inline constexpr std::uint64_t kMostCloudPoints = std::uint64_t{1} << 24U;
inline constexpr std::uint64_t kMostCloudFileBytes = std::uint64_t{2} << 30U;
/// Bytes of a point that is read: in Cloud, and in the Scan that it is copied to, without
/// times.
inline constexpr std::uint64_t kScanPointBytes = 25 + 18;
/// Most bytes of the text before the points.
inline constexpr std::size_t kMostCloudHeaderBytes = std::size_t{1} << 16U;
/// After the header of a compressed PCD file, two sizes: of the points as stored, and unpacked.
inline constexpr std::size_t kPcdSizesBytes = 8;

/// The content of a file's header, checked against the file's size: points that the file cannot
/// hold are refused before memory is allocated for them.
struct CloudSummary {
  std::size_t points = 0;
  bool has_labels = false;        ///< A field label, class or semantic.
  bool has_viewpoint = false;     ///< Other than the identity (PCD).
  bool keeps_no_returns = false;  ///< A field no_return, which is asked for.
};

/// The points of a file. Reused for each file, so that its memory is kept.
struct Cloud {
  std::vector<float> points_xyzi;     ///< Metres, sensor frame, as stored; intensity 0 without one.
  std::vector<std::int64_t> raw_ids;  ///< One per point, or empty.
  /// One per point, or empty. Not 0: nothing came back from the direction of the point.
  std::vector<std::uint8_t> no_return;

  [[nodiscard]] std::size_t num_points() const noexcept {
    return points_xyzi.size() / kFloatsPerPoint;
  }
};

/// The whole of a file and its name, for messages.
struct CloudBytes {
  std::string_view path;
  std::string_view bytes;
  bool with_labels = true;       ///< If false, label fields are ignored, even invalid ones.
  bool with_no_returns = false;  ///< If false, points of which no_return is not 0 are left out.
};

/// Text of a file for a message: at most 32 bytes, with '?' for what is not printable ASCII, as a
/// file of another kind may contain anything.
[[nodiscard]] std::string printable(std::string_view text);
/// "path: what; remedy", always in one line.
[[nodiscard]] Failure cloud_failure(std::string_view path, std::string_view what,
                                    std::string_view remedy);
/// The failure of a file with more points than a scan may have.
[[nodiscard]] Failure too_many_points(std::string_view path, std::uint64_t points);

/// The first bytes of a file, enough for its header, and its size.
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
