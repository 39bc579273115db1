// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The moving window of "map" and its archive: set up, stepped, and merged into one map at the end.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/outcome.hpp"
#include "cli/map_report.hpp"
#include "maps/held_archive.hpp"
#include "maps/stored_map.hpp"
#include "settings/map_options.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera {

/// The header of the map to continue: of the map file, or of the archive itself if that is named.
/// Fails with kUsage iff it cannot be read, or the archive holds another state than the file; and,
/// if there is nothing to continue, iff the archive holds blocks.
Outcome<std::optional<MapFileHeader>> earlier_map(const MapOptions& options,
                                                  const std::optional<ArchiveContent>& archive);

/// Lets "--continue DIR/blocks.tsa" continue DIR's archive. True if that is the folder beside the
/// output to which blocks go that do not fit in memory. Fails with kUsage iff no archive is named
/// and an earlier run left blocks in that folder.
Outcome<bool> find_spilled(MapOptions& options);

/// Gives a run that keeps all of its map a window for when memory is full: scans reach within it,
/// and no block leaves it while half of the storage is free. There is none without a limit of the
/// range, or with one of more blocks than a window has. After split_budget.
void set_up_spilling(const MapOptions& options, MapSetup& setup);

class MapWindow {
 public:
  /// Gives the mapper, which has a window and outlives this, its archive: the one that options
  /// name, or one that is made when memory is first short. Fails as ArchiveFile::open.
  static Outcome<std::unique_ptr<MapWindow>> make(const MapOptions& options, const MapSetup& setup,
                                                  const MapIdentity& identity,
                                                  const std::optional<ArchiveContent>& archive,
                                                  Mapper& mapper);
  MapWindow(const MapWindow&) = delete;
  MapWindow& operator=(const MapWindow&) = delete;

  /// Of the heap, for an archive that was made while scans were mapped.
  [[nodiscard]] std::uint64_t opening_allocations() const { return opening_allocations_; }
  /// Why blocks could not leave the map since the last call, or nothing.
  std::optional<std::string> obstacle();
  /// After the last scan: the totals for the report, with warnings about what was lost or left.
  [[nodiscard]] WindowTotals report(const WindowReport& window) const;
  [[nodiscard]] bool has_archive() const { return archive_.has_value(); }
  /// Of an archive.
  [[nodiscard]] const std::string& path() const { return (*archive_)->path(); }
  [[nodiscard]] std::size_t archived_blocks() const { return (*archive_)->blocks().index().size(); }
  /// Of map and archive together.
  [[nodiscard]] std::size_t blocks() const;
  /// Removes the archive, whose blocks are in the map file now.
  void remove_archive();
  /// Moves the whole map to the archive, then writes everything to path and returns what that
  /// holds. The map is unusable afterwards. Fails with kFailure iff an archived block cannot be
  /// read, or the file cannot be written.
  Outcome<MapSummary> save_whole(LocalMap& map, const MapIdentity& identity,
                                 const std::string& path);

 private:
  MapWindow(const MapSetup& setup, const MapIdentity& identity, std::string folder, Mapper& mapper)
      : setup_(setup), identity_(identity), folder_(std::move(folder)), mapper_(mapper) {}
  [[nodiscard]] Outcome<void> open(const ArchiveContent* found);
  void open_for_first_block();

  MapSetup setup_;
  MapIdentity identity_;
  std::string folder_;  ///< Empty: blocks that leave are lost.
  Mapper& mapper_;
  std::optional<HeldArchive> archive_;
  std::optional<Failure> not_opened_;
  ArchiveCounts known_{};  ///< At the last call of obstacle().
  std::uint64_t opening_allocations_ = 0;
};

}  // namespace tessera
