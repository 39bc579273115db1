// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_window.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "maps/whole_map_file.hpp"

namespace tessera {

namespace {

namespace fs = std::filesystem;

bool continues_archive(const MapOptions& options) {
  std::error_code error;
  return fs::equivalent(options.continue_from, archive_path(options.archive), error);
}

bool same_map(const MapFileHeader& a, const MapFileHeader& b) {
  const auto same = [](double x, double y) { return !(x < y) && !(x > y); };
  const MapConfig& x = a.config;
  const MapConfig& y = b.config;
  return same(x.resolution_m, y.resolution_m) && same(x.prior, y.prior) &&
         same(static_cast<double>(x.max_evidence), static_cast<double>(y.max_evidence)) &&
         same(static_cast<double>(x.free_weight), static_cast<double>(y.free_weight)) &&
         x.tuple == y.tuple && a.classes == b.classes && a.identity.robot == b.identity.robot &&
         a.identity.epoch == b.identity.epoch;
}

}  // namespace

Outcome<std::optional<MapFileHeader>> earlier_map(const MapOptions& options,
                                                  const std::optional<ArchiveContent>& archive) {
  const std::string path = archive_path(options.archive);
  if (options.continue_from.empty()) {
    if (!archive) return std::optional<MapFileHeader>();
    return Failure{path +
                   " holds the blocks of an earlier run; continue it with --continue and "
                   "the map file of that run, or with --continue " +
                   path + ", or choose another --archive"};
  }
  if (archive && continues_archive(options)) return std::optional(archive->header);
  const Outcome<MapFileHeader> header = load_map_header(options.continue_from);
  if (!header.ok()) return header.failure();
  const bool match = !archive || (archive->complete && archive->revision == header->revision &&
                                  same_map(archive->header, *header));
  if (!match) {
    return Failure{path + " holds another state than " + options.continue_from +
                   "; continue the archive with --continue " + path +
                   ", or choose another --archive"};
  }
  return std::optional(*header);
}

Outcome<std::unique_ptr<MapWindow>> MapWindow::make(const MapOptions& options,
                                                    const MapSetup& setup,
                                                    const MapIdentity& identity,
                                                    const std::optional<ArchiveContent>& archive,
                                                    Mapper& mapper) {
  std::unique_ptr<MapWindow> window(new MapWindow);
  window->radius_m_ = setup.window->radius_m;
  if (options.archive.empty()) return window;
  Outcome<HeldArchive> held =
      HeldArchive::make(options.archive, setup, identity, archive ? &*archive : nullptr, mapper);
  if (!held.ok()) return held.failure();
  window->archive_.emplace(std::move(*held));
  if (archive && archive->torn_bytes > 0) {
    warn((*window->archive_)->path() +
         " ends inside a record, as a run was cut short; ignoring its last " +
         counted(archive->torn_bytes, "byte"));
  }
  return window;
}

WindowTotals MapWindow::report(const WindowReport& window) const {
  const WindowTotals totals = totals_of(window, radius_m_, archive_ ? &*archive_ : nullptr);
  if (window.lost_blocks > 0) {
    warn(counted(window.lost_blocks, "block") +
         " left the window and their evidence is lost; give --archive DIR to keep it");
  }
  if (!archive_) return totals;
  const ArchiveFile& archive = **archive_;
  const ArchiveCounts& counts = archive.blocks().counts();
  if (counts.no_index > 0) {
    warn("the archive's index for " + counted(archive.blocks().index().capacity(), "block") +
         " is full; continue with --continue and a larger --memory");
  }
  if (counts.not_written > 0)
    warn(counted(counts.not_written, "time") + " a block could not be written to " +
         archive.path() + " and stayed in the map; free some space");
  if (counts.not_read > 0)
    warn(counted(counts.not_read, "time") + " a block could not be read from " + archive.path());
  return totals;
}

Outcome<std::uint64_t> MapWindow::save_whole(LocalMap& map, const MapIdentity& identity,
                                             const std::string& path) {
  ArchiveFile& archive = **archive_;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    if (archive.blocks().evict(map, map.block_at(item.index))) map.remove_block(item.index);
  }
  const bool all_archived = map.block_count() == 0;
  const Outcome<void> completed = all_archived ? archive.complete(map.revision()) : Outcome<void>();
  if (!all_archived || !completed.ok()) {
    warn(archive.path() +
         " could not take all of the map; it cannot be continued together "
         "with " +
         path + ", which has all of it");
  }
  const Outcome<std::uint64_t> content =
      all_archived ? digest_of_archived(map, archive) : digest_of_whole(map, archive);
  if (!content.ok()) return content.failure();
  const Outcome<void> saved = all_archived ? save_archived(map, archive, identity, path)
                                           : tessera::save_whole(map, archive, identity, path);
  if (!saved.ok()) return saved.failure();
  return *content;
}

}  // namespace tessera
