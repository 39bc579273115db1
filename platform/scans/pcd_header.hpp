// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The header of a PCD file, versions .5 to .7, checked against the size of the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "scans/cloud.hpp"
#include "scans/point_fields.hpp"
#include "scans/stored_number.hpp"

namespace tessera {

enum class PcdData : std::uint8_t { kAscii, kBinary, kCompressed };

struct PcdField {
  StoredNumber number;
  std::uint64_t count = 1;         ///< Numbers in the field.
  std::uint64_t offset_bytes = 0;  ///< In the record of a point.
  std::uint64_t offset_words = 0;  ///< In the row of a point.
};

struct PcdHeader {
  static constexpr std::uint64_t kMostRecordBytes = std::uint64_t{1} << 20U;
  /// Most bytes of compressed points, unpacked and as a scan together, as both exist at one time.
  static constexpr std::uint64_t kMostUnpackedBytes = std::uint64_t{1} << 29U;

  std::vector<PcdField> fields;
  PointFields chosen;
  std::uint64_t points = 0;
  bool is_organised = false;   ///< With several rows.
  bool has_viewpoint = false;  ///< Other than the identity.
  PcdData data = PcdData::kAscii;
  std::uint64_t record_bytes = 0;
  std::uint64_t record_words = 0;
  std::size_t header_bytes = 0;
  std::size_t header_lines = 0;
  std::uint64_t compressed_bytes = 0;  ///< kCompressed only.

  [[nodiscard]] CloudSummary summary() const noexcept;
};

/// head: the first bytes of a file of file_bytes. Fails with kUsage, naming the file, the line and
/// the remedy, iff the header is malformed or does not end within kMostCloudHeaderBytes, there are
/// no fields x, y and z, there are more than kMostCloudPoints points, a record has more than
/// kMostRecordBytes, compressed points and kScanPointBytes for each take over kMostUnpackedBytes,
/// or the file is too short for the points that the header promises.
Outcome<PcdHeader> parse_pcd_header(const CloudBytes& head, std::uint64_t file_bytes);

}  // namespace tessera
