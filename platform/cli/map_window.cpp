// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_window.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/allocation_counter.hpp"
#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "cli/losses.hpp"
#include "maps/whole_map_file.hpp"
#include "scans/scan_losses.hpp"
#include "settings/window_setup.hpp"

namespace tessera {

namespace {

namespace fs = std::filesystem;

/// Where blocks go that do not fit in memory.
std::string spill_folder(const MapOptions& options) { return options.out + ".archive"; }

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
  TESSERA_TRY_ASSIGN(const MapFileHeader header, load_map_header(options.continue_from));
  const bool match = !archive || (archive->complete && archive->revision == header.revision &&
                                  same_map(archive->header, header));
  if (!match) {
    return Failure{path + " holds another state than " + options.continue_from +
                   "; continue the archive with --continue " + path +
                   ", or choose another --archive"};
  }
  return std::optional(header);
}

Outcome<bool> find_spilled(MapOptions& options) {
  const std::string folder = spill_folder(options);
  const fs::path continued(options.continue_from);
  std::error_code error;
  if (!options.archive.empty()) return false;
  if (continued.filename() == ArchiveFile::kName) {
    options.archive = continued.has_parent_path() ? continued.parent_path().string() : ".";
    return fs::equivalent(options.archive, folder, error);
  }
  TESSERA_TRY_ASSIGN(const std::optional<ArchiveContent> left, find_archive(folder));
  if (!left) return false;
  const std::string path = archive_path(folder);
  return Failure{path +
                 " holds the blocks of an earlier run that did not end; continue it with "
                 "--continue " +
                 path + ", or remove it"};
}

void set_up_spilling(const MapOptions& options, MapSetup& setup) {
  if (setup.window) return;
  const double reach = reach_m(options);
  const double edge_m = setup.map.resolution_m * kBlockEdge;
  const double most = kMostWindowBlocks * edge_m;
  WindowConfig& window = setup.window.emplace();
  window.radius_m = reach > 0.0 ? std::min(reach, most) : most;
  window.hysteresis_m = 2.0 * edge_m;
  window.keep_while_room = window.evicts_near = true;
  window.reserve = half_of_storage(setup);
}

Outcome<std::unique_ptr<MapWindow>> MapWindow::make(const MapOptions& options,
                                                    const MapSetup& setup,
                                                    const MapIdentity& identity,
                                                    const std::optional<ArchiveContent>& archive,
                                                    Mapper& mapper) {
  const bool spills = setup.window->keep_while_room;
  const std::string folder = spills ? spill_folder(options) : options.archive;
  std::unique_ptr<MapWindow> window(new MapWindow(setup, identity, folder, mapper));
  if (spills) {
    // Only takes blocks: with the first one it is replaced by a file.
    mapper.set_archive({.context = window.get(),
                        .evict = [](void* context, const LocalMap& map, const Block& block) {
                          auto& self = *static_cast<MapWindow*>(context);
                          if (!self.archive_) self.open_for_first_block();
                          return self.archive_ && (*self.archive_)->blocks().evict(map, block);
                        }});
    return window;
  }
  if (folder.empty()) return window;
  TESSERA_TRY(window->open(archive ? &*archive : nullptr));
  if (archive && archive->torn_bytes > 0) {
    warn(window->path() + " ends inside a record, as a run was cut short; ignoring its last " +
         counted(archive->torn_bytes, "byte"));
  }
  if (archive && !archive->complete) {
    warn(window->path() + " is of a run that was cut short: what was in memory then is missing");
  }
  return window;
}

Outcome<void> MapWindow::open(const ArchiveContent* found) {
  TESSERA_TRY_ASSIGN(HeldArchive held,
                     HeldArchive::make(folder_, setup_, identity_, found, mapper_));
  archive_.emplace(std::move(held));
  return {};
}

void MapWindow::open_for_first_block() {
  if (not_opened_) return;
  const std::uint64_t before = heap_allocations().value_or(0);
  const Outcome<void> opened = open(nullptr);
  opening_allocations_ = heap_allocations().value_or(0) - before;
  if (opened.ok()) return;
  not_opened_ = opened.failure();
  std::error_code error;
  if (!fs::is_directory(folder_, error)) return;
  fs::remove(archive_path(folder_), error);
  fs::remove(folder_, error);
}

std::optional<std::string> MapWindow::obstacle() {
  if (not_opened_) return not_opened_->text();
  if (!archive_) return std::nullopt;
  const ArchiveCounts before = known_;
  known_ = (*archive_)->blocks().counts();
  if (known_.not_written > before.not_written)
    return path() + " cannot be written; free some space";
  if (known_.no_index > before.no_index) return "the index of " + path() + " is full";
  return std::nullopt;
}

std::size_t MapWindow::blocks() const {
  const LocalMap& map = mapper_.map();
  if (!archive_) return map.block_count();
  const ArchiveIndex& index = (*archive_)->blocks().index();
  std::size_t count = index.size();
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for (const KeyedIndex& item : map.blocks_in_order(workspace))
    count += index.find(BlockKey{item.key}) ? 0U : 1U;
  return count;
}

void MapWindow::remove_archive() {
  if (!archive_) return;
  std::error_code error;
  (*archive_)->remove();
  fs::remove(folder_, error);
}

WindowTotals MapWindow::report(const WindowReport& window) const {
  const WindowTotals totals =
      totals_of(window, setup_.window->radius_m, archive_ ? &*archive_ : nullptr);
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

Outcome<MapSummary> MapWindow::save_whole(LocalMap& map, const MapIdentity& identity,
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
  return all_archived ? save_archived(map, archive, identity, path)
                      : tessera::save_whole(map, archive, identity, path);
}

}  // namespace tessera
