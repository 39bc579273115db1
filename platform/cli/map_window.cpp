// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_window.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/allocation_counter.hpp"
#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "maps/whole_map.hpp"
#include "tessera/map/queries.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

namespace {

namespace fs = std::filesystem;

fs::path archive_path(const MapOptions& options) {
  return fs::path(options.archive) / ArchiveFile::kName;
}

bool continues_archive(const MapOptions& options) {
  std::error_code error;
  return fs::equivalent(options.continue_from, archive_path(options), error);
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

Outcome<std::optional<ArchiveContent>> find_archive(const MapOptions& options) {
  std::error_code error;
  if (options.archive.empty() || !fs::exists(archive_path(options), error))
    return std::optional<ArchiveContent>();
  const Outcome<ArchiveContent> content = ArchiveFile::inspect(archive_path(options).string());
  if (!content.ok()) return content.failure();
  if (content->records == 0) return std::optional<ArchiveContent>();
  return std::optional(*content);
}

Outcome<std::optional<MapFileHeader>> earlier_map(const MapOptions& options,
                                                  const std::optional<ArchiveContent>& archive) {
  const std::string path = archive_path(options).string();
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

std::size_t archive_blocks(const MapSetup& setup, const std::optional<ArchiveContent>& archive) {
  constexpr std::size_t kBytesPerBlock = 26;
  const std::size_t by_budget = setup.budget_bytes / 16 / kBytesPerBlock;
  const std::size_t by_content = archive ? 2 * static_cast<std::size_t>(archive->records) : 0;
  return std::max<std::size_t>({by_budget, by_content, 1024});
}

std::string spill_folder(const MapOptions& options) { return options.out + ".archive"; }

bool is_spill_folder(const MapOptions& options) {
  if (options.archive.empty()) return !options.window_m;
  std::error_code error;
  return fs::equivalent(options.archive, spill_folder(options), error);
}

Outcome<void> find_spilled(MapOptions& options) {
  const fs::path continued(options.continue_from);
  if (options.archive.empty() && continued.filename() == ArchiveFile::kName)
    options.archive = continued.has_parent_path() ? continued.parent_path().string() : ".";
  if (!options.archive.empty() || options.window_m) return {};
  const std::string left = spill_folder(options) + "/" + ArchiveFile::kName;
  std::error_code error;
  if (!fs::exists(left, error)) return {};
  return Failure{left +
                 " holds the blocks of an earlier run that did not end; continue it with "
                 "--continue " +
                 left + ", or remove it"};
}

void set_up_spilling(const MapOptions& options, MapSetup& setup) {
  if (setup.window || options.max_range_m <= 0.0) return;
  WindowConfig& window = setup.window.emplace();
  window.radius_m = reach_m(options);
  window.keep_while_room = true;
  constexpr std::size_t kOctetBytes = 512;
  SlabPool::Counts& reserve = window.reserve;
  const std::size_t bytes = reserve[0] * sizeof(Block) + reserve[1] * sizeof(LabelPage) +
                            reserve[2] * sizeof(FreePage) + reserve[3] * kOctetBytes;
  const double times =
      static_cast<double>(setup.map.storage_bytes / 2) / static_cast<double>(bytes);
  for (std::uint32_t& count : reserve)
    count = static_cast<std::uint32_t>(times * static_cast<double>(count));
}

void move_all_at_once(MapSetup& setup) {
  if (!setup.window || setup.deadline_us != 0) return;
  constexpr std::uint32_t kAll = 1U << 30U;
  WindowConfig& window = *setup.window;
  window.entries_per_step = window.evictions_per_step = window.pressed_evictions_per_step = kAll;
  window.regions_per_step = window.reloads_per_step = window.label_voxels_per_step = kAll;
}

Outcome<std::unique_ptr<MapWindow>> MapWindow::make(const MapOptions& options,
                                                    const MapSetup& setup,
                                                    const MapIdentity& identity,
                                                    const std::optional<ArchiveContent>& archive,
                                                    Mapper& mapper) {
  std::unique_ptr<MapWindow> window(new MapWindow);
  window->radius_m_ = setup.window->radius_m;
  window->identity_ = identity;
  window->index_blocks_ = archive_blocks(setup, archive);
  if (setup.window->keep_while_room) {
    window->folder_ = spill_folder(options);
    mapper.set_archive(window->spilling());
    return window;
  }
  if (options.archive.empty()) return window;
  window->folder_ = options.archive;
  const Outcome<void> opened = window->open(mapper.map(), archive ? &*archive : nullptr);
  if (!opened.ok()) return opened.failure();
  if (archive && archive->torn_bytes > 0) {
    warn(window->archive_->path() +
         " ends inside a record, as a run was cut short; ignoring its last " +
         counted(archive->torn_bytes, "byte"));
  }
  mapper.set_archive(window->opened_);
  return window;
}

Outcome<void> MapWindow::open(const LocalMap& map, const ArchiveContent* found) {
  Outcome<ArenaMemory> memory = ArenaMemory::allocate(
      ArchiveFile::required_bytes(map.config(), map.num_components(), index_blocks_));
  if (!memory.ok()) return memory.failure();
  memory_ = std::move(*memory);
  Arena arena(memory_.span());
  Outcome<std::unique_ptr<ArchiveFile>> file =
      ArchiveFile::open(folder_, map, identity_, index_blocks_, arena, found);
  if (!file.ok()) return file.failure();
  archive_ = std::move(*file);
  opened_ = archive_->interface();
  return {};
}

/// The archive is made when the first block has to leave.
BlockArchive MapWindow::spilling() noexcept {
  BlockArchive archive;
  archive.context = this;
  archive.evict = [](void* context, const LocalMap& map, const Block& block) {
    auto& window = *static_cast<MapWindow*>(context);
    if (window.not_opened_) return false;
    if (window.archive_ == nullptr) {
      const std::uint64_t before = heap_allocations().value_or(0);
      const Outcome<void> opened = window.open(map, nullptr);
      window.opening_allocations_ = heap_allocations().value_or(0) - before;
      if (!opened.ok()) {
        window.not_opened_ = opened.failure();
        return false;
      }
    }
    return window.opened_.evict(window.opened_.context, map, block);
  };
  archive.archived = [](void* context, BlockCoord region) -> const RegionMask* {
    const BlockArchive& opened = static_cast<MapWindow*>(context)->opened_;
    return opened.archived == nullptr ? nullptr : opened.archived(opened.context, region);
  };
  archive.reload = [](void* context, LocalMap& map, BlockKey key) {
    const BlockArchive& opened = static_cast<MapWindow*>(context)->opened_;
    return opened.reload(opened.context, map, key);
  };
  return archive;
}

std::optional<std::string> MapWindow::obstacle() const {
  if (not_opened_) return not_opened_->message;
  if (archive_ == nullptr) return std::nullopt;
  const ArchiveCounts& counts = archive_->counts();
  if (counts.not_written > 0) return archive_->path() + " cannot be written; free some space";
  if (counts.no_index > 0) return "the index of " + archive_->path() + " is full";
  return std::nullopt;
}

void MapWindow::remove_spilled() {
  if (archive_ == nullptr) return;
  archive_.reset();
  opened_ = {};
  std::error_code error;
  fs::remove(fs::path(folder_) / ArchiveFile::kName, error);
  fs::remove(folder_, error);
}

WindowTotals MapWindow::report(const WindowReport& window) const {
  WindowTotals totals{window};
  totals.radius_m = radius_m_;
  if (window.lost_blocks > 0) {
    warn(counted(window.lost_blocks, "block") +
         " left the window and their evidence is lost; give --archive DIR to keep it");
  }
  if (archive_ == nullptr) return totals;
  totals.merged += archive_->counts().evictions_merged;
  totals.archive_bytes = archive_->file_bytes();
  totals.archived_blocks = archive_->index().size();
  totals.index_bytes = memory_.span().size();
  const ArchiveCounts& counts = archive_->counts();
  if (counts.no_index > 0) {
    warn("the archive's index for " + counted(archive_->index().capacity(), "block") +
         " is full; continue with --continue and a larger --memory");
  }
  if (counts.not_written > 0)
    warn(counted(counts.not_written, "time") + " a block could not be written to " +
         archive_->path() + " and stayed in the map; free some space");
  if (counts.not_read > 0)
    warn(counted(counts.not_read, "time") + " a block could not be read from " + archive_->path());
  return totals;
}

Outcome<std::uint64_t> MapWindow::save_whole(LocalMap& map, const MapIdentity& identity,
                                             const std::string& path) {
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    if (archive_->evict(map, map.block_at(item.index))) map.remove_block(item.index);
  }
  const bool all_archived = map.block_count() == 0;
  const Outcome<void> completed =
      all_archived ? archive_->complete(map.revision()) : Outcome<void>();
  if (!all_archived || !completed.ok()) {
    warn(archive_->path() +
         " could not take all of the map; it cannot be continued together "
         "with " +
         path + ", which has all of it");
  }
  WholeMap whole(map, *archive_);
  const Outcome<std::vector<KeyedIndex>> keys = whole.keys();
  if (!keys.ok()) return keys.failure();
  const Result<std::uint64_t> content = digest(map, *keys, whole.lookup());
  if (!content.ok()) return whole.unreadable();
  const Outcome<void> saved = save_map(map, identity, *keys, whole.lookup(), path);
  if (!saved.ok()) return saved.failure();
  return *content;
}

}  // namespace tessera
