// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map file of submaps: an empty map of the kind kSubmaps, whose header says what all have in
// common; then a complete map file of each submap; then a table with their frames, and an end that
// says where it is. docs/reference/memory.md has the layout byte by byte. So a submap is written
// once, and a frame is corrected by another table.
#pragma once

#include "tessera/base/rigid_code.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

/// What a table says of a submap.
struct SubmapRow {
  static constexpr std::size_t kBytes = 94;
  std::uint32_t number = 0;
  std::uint32_t revision = 1;    ///< Of its frame, from 1.
  std::uint32_t first_scan = 0;  ///< Numbers of the scans that are in it.
  std::uint32_t last_scan = 0;
  double length_m = 0.0;           ///< Way that the robot drove in it.
  RigidCode T_map_submap;          ///< Its frame in that of the whole map.
  std::uint64_t offset_bytes = 0;  ///< Of its map file.
  std::uint64_t bytes = 0;
  std::uint64_t digest = 0;  ///< Of its content.
  std::uint64_t label_voxels = 0;
  std::uint64_t free_voxels = 0;
  std::uint64_t occupied = 0;
  friend constexpr bool operator==(const SubmapRow&, const SubmapRow&) = default;
};

/// Submaps of one file, at most.
inline constexpr std::uint32_t kMostSubmaps = 65'535;

/// Where the table of a file is.
struct SubmapTableEnd {
  static constexpr std::size_t kBytes = 24;
  std::uint64_t offset_bytes = 0;
  std::uint32_t submaps = 0;
  std::uint32_t checksum = 0;  ///< CRC-32C of the rows.
};

/// Writes rows and the end. offset_bytes: where in the file this is; rows: by ascending numbers, at
/// most kMostSubmaps. Fails with kInvalidArgument iff there are more, with kIo iff the sink
/// refuses. O(rows).
MapFileStatus save_submap_table(std::span<const SubmapRow> rows, std::uint64_t offset_bytes,
                                const ByteSink& sink) noexcept;

/// Reads the end of a file of file_bytes. Fails with kTruncated or kCorrupt. O(1).
MapFileStatus load_submap_end(std::span<const std::byte, SubmapTableEnd::kBytes> bytes,
                              std::uint64_t file_bytes, SubmapTableEnd& end) noexcept;

/// Reads the rows, from a source that stands at the table. rows: of end.submaps. Fails with
/// kTruncated or kCorrupt: a checksum, numbers or places out of order, a frame that is none.
/// O(rows).
MapFileStatus load_submap_table(const ByteSource& source, const SubmapTableEnd& end,
                                std::span<SubmapRow> rows) noexcept;

/// Over the numbers, frames and contents of submaps. O(rows).
[[nodiscard]] std::uint64_t digest(std::span<const SubmapRow> rows) noexcept;

}  // namespace tessera
