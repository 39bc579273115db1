// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The header of a PCD file, versions .5 to .7, and whether the file can be what it says.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "clouds/cloud.hpp"
#include "clouds/point_fields.hpp"
#include "clouds/stored_number.hpp"
#include "posix/outcome.hpp"

namespace tessera {

enum class PcdData : std::uint8_t { kAscii, kBinary, kCompressed };

struct PcdField {
  StoredNumber number;
  std::uint64_t count = 1;         ///< Numbers in it.
  std::uint64_t offset_bytes = 0;  ///< In a point's record.
  std::uint64_t offset_words = 0;  ///< In a point's row.
};

struct PcdHeader {
  static constexpr std::uint64_t kMostRecordBytes = std::uint64_t{1} << 20U;
  /// Of compressed points, unpacked and as a scan has them, which are there at one time.
  static constexpr std::uint64_t kMostUnpackedBytes = std::uint64_t{1} << 29U;

  std::vector<PcdField> fields;
  PointFields chosen;
  std::uint64_t points = 0;
  bool is_organised = false;   ///< Of several rows.
  bool has_viewpoint = false;  ///< Another one than the identity.
  PcdData data = PcdData::kAscii;
  std::uint64_t record_bytes = 0;
  std::uint64_t record_words = 0;
  std::size_t header_bytes = 0;
  std::size_t header_lines = 0;
  std::uint64_t compressed_bytes = 0;  ///< kCompressed only.

  [[nodiscard]] CloudSummary summary() const noexcept;
};

/// head: the first bytes of a file of file_bytes. Fails with kUsage, naming the file, the line and
/// the remedy, iff the header is malformed or ends not within kMostCloudHeaderBytes, there are no
/// fields x, y and z, there are more than kMostCloudPoints points, a record has more than
/// kMostRecordBytes, compressed points and kScanPointBytes for each take over kMostUnpackedBytes,
/// or the file is too short for the points that the header promises.
Outcome<PcdHeader> parse_pcd_header(const CloudBytes& head, std::uint64_t file_bytes);

}  // namespace tessera
