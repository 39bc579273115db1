// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The moving window of "map" and its archive: set up, stepped, and made one map again at the end.
#pragma once

#include <memory>
#include <optional>

#include "archive/archive_file.hpp"
#include "cli/map_report.hpp"
#include "mapping/map_options.hpp"
#include "mapping/stored_map.hpp"
#include "posix/outcome.hpp"

namespace tessera {

/// The archive that options name, if it is there and holds blocks. Fails with kUsage iff its file
/// cannot be read or is no archive.
Outcome<std::optional<ArchiveContent>> find_archive(const MapOptions& options);

/// The header of the map to continue: of the map file, or of the archive itself where that is
/// named. Fails with kUsage iff it cannot be read, or the archive holds another state than the
/// file; and, if there is nothing to continue, iff the archive holds blocks.
Outcome<std::optional<MapFileHeader>> earlier_map(const MapOptions& options,
                                                  const std::optional<ArchiveContent>& archive);

/// Blocks that the archive's index is made for: what a sixteenth of the budget holds, and twice
/// what is archived.
std::size_t archive_blocks(const MapSetup& setup, const std::optional<ArchiveContent>& archive);

class MapWindow {
 public:
  /// Fails as ArchiveFile::open.
  static Outcome<std::unique_ptr<MapWindow>> make(const MapOptions& options, const MapSetup& setup,
                                                  const LocalMap& map, const MapIdentity& identity,
                                                  const std::optional<ArchiveContent>& archive);
  MapWindow(const MapWindow&) = delete;
  MapWindow& operator=(const MapWindow&) = delete;

  /// Before a scan. No heap.
  void step(LocalMap& map, const ScanView& scan);
  /// After the last scan: totals for the report, and a warning for what was lost or is left.
  void report(WindowTotals& totals) const;
  [[nodiscard]] bool has_archive() const { return archive_ != nullptr; }
  /// Moves all of the map to the archive, then writes the whole to path and gives its digest. The
  /// map is of no further use. Fails with kFailure iff an archived block cannot be read, or the
  /// file cannot be written.
  Outcome<std::uint64_t> save_whole(LocalMap& map, const MapIdentity& identity,
                                    const std::string& path);

 private:
  MapWindow() = default;

  MovingWindow window_{};
  ArenaMemory memory_{};
  std::unique_ptr<ArchiveFile> archive_;
  BlockArchive keeper_{};
  std::uint64_t lost_blocks_ = 0;
  WindowTotals totals_{};
};

}  // namespace tessera
