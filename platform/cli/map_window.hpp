// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The moving window of "map" and its archive: set up, stepped, and merged into one map at the end.
#pragma once

#include <memory>
#include <optional>

#include "base/outcome.hpp"
#include "cli/map_report.hpp"
#include "maps/archive_file.hpp"
#include "maps/stored_map.hpp"
#include "settings/map_options.hpp"
#include "tessera/robot/mapper.hpp"

namespace tessera {

/// The archive that options name, if it exists and holds blocks. Fails with kUsage iff its file
/// cannot be read or is not an archive.
Outcome<std::optional<ArchiveContent>> find_archive(const MapOptions& options);

/// The header of the map to continue: of the map file, or of the archive itself if that is named.
/// Fails with kUsage iff it cannot be read, or the archive holds another state than the file; and,
/// if there is nothing to continue, iff the archive holds blocks.
Outcome<std::optional<MapFileHeader>> earlier_map(const MapOptions& options,
                                                  const std::optional<ArchiveContent>& archive);

/// The folder beside the output for blocks that do not fit in memory, where options name neither
/// window nor archive.
std::string spill_folder(const MapOptions& options);

/// True if it is where this run's blocks go.
bool is_spill_folder(const MapOptions& options);

/// "--continue DIR/blocks.tsa" continues DIR's archive. Fails with kUsage iff an earlier run left
/// blocks in the spill folder and is not continued.
Outcome<void> find_spilled(MapOptions& options);

/// Gives a run that keeps all of its map a window for when memory is full: scans reach within it,
/// and no block leaves it while half of the storage is free. Without --max-range there is none.
/// After split_budget.
void set_up_spilling(const MapOptions& options, MapSetup& setup);

/// Lets a window that has no deadline move all blocks that it has to, however far scans are apart.
void move_all_at_once(MapSetup& setup);

/// Capacity of the archive's index in blocks: as a sixteenth of the budget holds, and at least
/// twice the number of archived blocks.
std::size_t archive_blocks(const MapSetup& setup, const std::optional<ArchiveContent>& archive);

class MapWindow {
 public:
  /// Gives the mapper, which has a window, its archive: the one that options name, or one that is
  /// made when memory is first short. Fails as ArchiveFile::open.
  static Outcome<std::unique_ptr<MapWindow>> make(const MapOptions& options, const MapSetup& setup,
                                                  const MapIdentity& identity,
                                                  const std::optional<ArchiveContent>& archive,
                                                  Mapper& mapper);
  MapWindow(const MapWindow&) = delete;
  MapWindow& operator=(const MapWindow&) = delete;

  /// Of the heap, for an archive that was made while scans were mapped.
  [[nodiscard]] std::uint64_t opening_allocations() const { return opening_allocations_; }
  /// Why blocks that should leave the map cannot, or nothing.
  [[nodiscard]] std::optional<std::string> obstacle() const;
  /// After the last scan: the totals for the report, with warnings about what was lost or left.
  [[nodiscard]] WindowTotals report(const WindowReport& window) const;
  [[nodiscard]] bool has_archive() const { return archive_ != nullptr; }
  /// Removes a spill folder whose blocks are in the map file now.
  void remove_spilled();
  /// Moves the whole map to the archive, then writes everything to path and returns its digest. The
  /// map is unusable afterwards. Fails with kFailure iff an archived block cannot be read, or the
  /// file cannot be written.
  Outcome<std::uint64_t> save_whole(LocalMap& map, const MapIdentity& identity,
                                    const std::string& path);

 private:
  MapWindow() = default;
  [[nodiscard]] BlockArchive spilling() noexcept;
  Outcome<void> open(const LocalMap& map, const ArchiveContent* found);

  std::string folder_;  ///< Empty: blocks that leave are lost.
  MapIdentity identity_;
  std::size_t index_blocks_ = 0;
  ArenaMemory memory_{};
  std::unique_ptr<ArchiveFile> archive_;
  BlockArchive opened_{};
  std::optional<Failure> not_opened_;
  std::uint64_t opening_allocations_ = 0;
  double radius_m_ = 0.0;
};

}  // namespace tessera
