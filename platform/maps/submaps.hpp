// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Map files of submaps: written one submap after the other, and read as the one map that their
// frames give.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "maps/stored_map.hpp"
#include "tessera/map/local_maps.hpp"
#include "tessera/submap/submap_file.hpp"

namespace tessera {

/// The row of a submap with a note of what was mapped into it; the rest is not known yet.
SubmapRow row_of(std::uint32_t number, const SubmapNote& note) noexcept;
/// Appends a map file with a submap to an open file. The row is completed but for its place; its
/// frame is where it was mapped. commit() explains a refused write.
Outcome<SubmapRow> append_submap(const LocalMap& map, const MapIdentity& identity, AtomicFile& file,
                                 SubmapRow row);

class SubmapWriter {
 public:
  /// Opens the file. common: an empty map with the settings and classes of all. identity: of the
  /// robot, with its record. Fails as AtomicFile::open.
  static Outcome<SubmapWriter> open(const std::string& path, const LocalMap& common,
                                    const MapIdentity& identity);
  /// Appends a submap. row: number, scans and length; place, digest and counts are filled in, and
  /// the frame is where it was mapped. Fails with kFailure iff there are kMostSubmaps.
  Outcome<void> add(const LocalMap& map, SubmapRow row);
  /// Appends a submap from a map file of its own; row: all but the place. Fails as add, and with
  /// kUsage iff the file cannot be read, kFailure iff it has other bytes than the row says.
  Outcome<void> add_file(const std::string& path, SubmapRow row);
  [[nodiscard]] std::vector<SubmapRow>& rows() noexcept { return rows_; }
  [[nodiscard]] const std::vector<SubmapRow>& rows() const noexcept { return rows_; }
  /// Appends the table, and puts the file under its name. Fails as AtomicFile::commit.
  Outcome<void> commit();

 private:
  SubmapWriter(AtomicFile file, const MapIdentity& identity)
      : file_(std::move(file)), identity_(identity) {}
  [[nodiscard]] Outcome<void> check_room() const;

  AtomicFile file_;
  MapIdentity identity_;
  std::uint64_t bytes_ = 0;
  std::vector<SubmapRow> rows_;
};

/// What a file says of its submaps.
struct StoredSubmaps {
  std::string path;
  MapFileHeader header;  ///< What all have in common.
  std::vector<SubmapRow> rows;
};

/// Reads the table. header: as load_map_header gave it. Fails with kUsage iff it is missing or
/// damaged.
Outcome<StoredSubmaps> load_submaps(const std::string& path, const MapFileHeader& header);
/// One of them. Fails as load_map, and with kUsage iff its settings, classes or content are not
/// what header and table say.
Outcome<std::unique_ptr<StoredMap>> load_submap(const StoredSubmaps& submaps, const SubmapRow& row);
/// A row, with its frame as a transform.
Json to_json(const SubmapRow& row);
/// The counts of all together, with the digest of the table; without an extent and labels.
MapSummary summary_of(const std::vector<SubmapRow>& rows);

}  // namespace tessera
