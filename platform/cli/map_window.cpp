// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_window.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/number_text.hpp"
#include "cli/command.hpp"
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

/// The map and its archive as one: blocks are read into the map's memory when they are requested.
class WholeMap {
 public:
  WholeMap(LocalMap& map, ArchiveFile& archive)
      : map_(map), archive_(archive), kept_(map.block_count()), revision_(map.revision()) {
    if (kept_ == 0) forget();
  }
  /// All keys in ascending order. Fails with kFailure iff a block that both have cannot be merged.
  Outcome<std::vector<KeyedIndex>> keys() {
    std::vector<KeyedIndex> workspace = workspace_for(map_);
    const std::span<const KeyedIndex> kept = map_.blocks_in_order(workspace);
    for (const KeyedIndex& item : kept) {
      const BlockKey key{item.key};
      if (archive_.index().find(key) && archive_.reload(map_, key) != Status::kOk)
        return unreadable();
    }
    const std::vector<KeyedIndex> archived = archive_.index().keys_in_order();
    std::vector<KeyedIndex> all(kept.size() + archived.size());
    std::merge(kept.begin(), kept.end(), archived.begin(), archived.end(), all.begin(),
               [](const KeyedIndex& a, const KeyedIndex& b) { return a.key < b.key; });
    return all;
  }
  BlockLookup lookup() {
    return {this, [](void* context, const KeyedIndex& item) {
              return static_cast<WholeMap*>(context)->find(BlockKey{item.key});
            }};
  }
  [[nodiscard]] Failure unreadable() const {
    return {"cannot read a block of " + archive_.path() +
                "; the map is not written: check the disk, or give a larger --memory",
            FailureKind::kFailure};
  }

 private:
  void forget() {
    if (kept_ == 0) {
      map_.clear();  // so that pages of the storage can serve other sizes again
      map_.restore_revision(revision_);
    } else {
      for (const BlockKey key : fetched_) {
        const Result<SlabHandle> handle = map_.open_block(unpack(key));  // exists
        if (handle.ok()) map_.remove_block(*handle);
      }
    }
    fetched_.clear();
  }
  const Block* find(BlockKey key) {
    if (const Block* const block = map_.find(unpack(key))) return block;
    Status status = archive_.read_into(map_, key);
    if (status == Status::kResourceExhausted) {
      forget();
      status = archive_.read_into(map_, key);
    }
    if (status != Status::kOk) return nullptr;
    fetched_.push_back(key);
    return map_.find(unpack(key));
  }

  LocalMap& map_;
  ArchiveFile& archive_;
  std::size_t kept_;  ///< Blocks that the archive did not take.
  std::uint32_t revision_;
  std::vector<BlockKey> fetched_;
};

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

Outcome<std::unique_ptr<MapWindow>> MapWindow::make(const MapOptions& options,
                                                    const MapSetup& setup,
                                                    const MapIdentity& identity,
                                                    const std::optional<ArchiveContent>& archive,
                                                    Mapper& mapper) {
  std::unique_ptr<MapWindow> window(new MapWindow);
  window->radius_m_ = setup.window->radius_m;
  if (options.archive.empty()) return window;
  Outcome<ArenaMemory> memory = ArenaMemory::allocate(setup.archive_bytes);
  if (!memory.ok()) return memory.failure();
  window->memory_ = std::move(*memory);
  Arena arena(window->memory_.span());
  Outcome<std::unique_ptr<ArchiveFile>> file =
      ArchiveFile::open(options.archive, mapper.map(), identity, archive_blocks(setup, archive),
                        arena, archive ? &*archive : nullptr);
  if (!file.ok()) return file.failure();
  if (archive && archive->torn_bytes > 0) {
    warn((*file)->path() + " ends inside a record, as a run was cut short; ignoring its last " +
         counted(archive->torn_bytes, "byte"));
  }
  window->archive_ = std::move(*file);
  mapper.set_archive(window->archive_->interface());
  return window;
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
