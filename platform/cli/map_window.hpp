// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The moving window of "map" and its archive: set up, stepped, and merged into one map at the end.
#pragma once

#include <memory>
#include <optional>

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

class MapWindow {
 public:
  /// Gives the mapper, which has a window, its archive if options name one. Fails as
  /// ArchiveFile::open.
  static Outcome<std::unique_ptr<MapWindow>> make(const MapOptions& options, const MapSetup& setup,
                                                  const MapIdentity& identity,
                                                  const std::optional<ArchiveContent>& archive,
                                                  Mapper& mapper);
  MapWindow(const MapWindow&) = delete;
  MapWindow& operator=(const MapWindow&) = delete;

  /// After the last scan: the totals for the report, with warnings about what was lost or left.
  [[nodiscard]] WindowTotals report(const WindowReport& window) const;
  [[nodiscard]] bool has_archive() const { return archive_.has_value(); }
  /// Moves the whole map to the archive, then writes everything to path and returns its digest. The
  /// map is unusable afterwards. Fails with kFailure iff an archived block cannot be read, or the
  /// file cannot be written.
  Outcome<std::uint64_t> save_whole(LocalMap& map, const MapIdentity& identity,
                                    const std::string& path);

 private:
  MapWindow() = default;

  std::optional<HeldArchive> archive_;
  double radius_m_ = 0.0;
};

}  // namespace tessera
