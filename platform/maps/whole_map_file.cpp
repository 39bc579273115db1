// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/whole_map_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <optional>

#include "base/system_failure.hpp"
#include "tessera/map/queries.hpp"
#include "tessera/map/whole_map.hpp"

namespace tessera {

namespace {

/// For the cache of WholeMap: some thousand blocks, more than a row has.
constexpr std::size_t kCacheBytes = std::size_t{16} << 20U;
constexpr std::size_t kCopyBytes = std::size_t{1} << 20U;  ///< Written at once.

Failure unreadable(const ArchiveFile& archive) {
  return {"cannot read a block of " + archive.path() + "; the map is not written: check the disk",
          FailureKind::kFailure};
}

struct Cache {
  ArenaMemory memory;
  LocalMap map;
};

Outcome<Cache> make_cache(MapConfig config, const ClassTable& classes) {
  config.storage_bytes =
      std::max(kCacheBytes, one_block_storage(config.tuple, classes.num_components()));
  Cache cache;
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(required_bytes(config)));
  cache.memory = std::move(memory);
  Arena arena(cache.memory.span());
  Result<LocalMap> map = LocalMap::make(arena, config, classes);
  if (!map.ok())
    return Failure{std::string("the map cannot be saved: ") + to_string(map.status()),
                   FailureKind::kFailure};
  cache.map = std::move(*map);
  return cache;
}

/// Calls use(cache, blocks, lookup) for a map and its archive.
template <class Use>
auto with_whole(const LocalMap& map, ArchiveFile& archive, Use&& use)
    -> decltype(use(map, std::span<const KeyedIndex>(), BlockLookup())) {
  TESSERA_TRY_ASSIGN(Cache cache, make_cache(map.config(), map.classes()));
  MapAndArchive both(map, archive.blocks());
  std::vector<KeyedIndex> workspace(both.workspace_entries());
  WholeMap whole(cache.map, map.revision(), both.map(), both.archive());
  return use(cache.map, both.blocks_in_order(workspace), whole.lookup());
}

/// A file without a name, beside another one.
Outcome<FileDescriptor> nameless_file(const std::string& beside) {
  std::string name = beside + "." + std::string(6, 'X');  // as mkostemp wants it
  FileDescriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (!file.is_open()) return system_failure("write", name, errno, FailureKind::kFailure);
  ::unlink(name.c_str());
  return file;
}

/// The item with that key, of items in the order of keys.
template <class Items>
auto find_in(const Items& items, BlockKey key) {
  const auto at =
      std::ranges::lower_bound(items, key.bits, {}, [](const auto& i) { return i.key; });
  return at != items.end() && at->key == key.bits ? &*at : nullptr;
}

auto save_to(const ArchiveFile& archive, const MapIdentity& identity, const std::string& path) {
  return [&](const LocalMap& cache, std::span<const KeyedIndex> blocks,
             const BlockLookup& find) -> Outcome<MapSummary> {
    const Result<MapSummary> summary = summarize(cache, blocks, find);
    if (!summary.ok()) return unreadable(archive);
    TESSERA_TRY(save_map(cache, identity, blocks, find, *summary, path));
    return *summary;
  };
}

auto digest_to(const ArchiveFile& archive) {
  return [&archive](const LocalMap& cache, std::span<const KeyedIndex> blocks,
                    const BlockLookup& find) -> Outcome<std::uint64_t> {
    const Result<std::uint64_t> content = digest(cache, blocks, find);
    if (!content.ok()) return unreadable(archive);
    return *content;
  };
}

}  // namespace

Outcome<MapSummary> save_whole(const LocalMap& map, ArchiveFile& archive,
                               const MapIdentity& identity, const std::string& path) {
  return with_whole(map, archive, save_to(archive, identity, path));
}

Outcome<std::uint64_t> digest_of_whole(const LocalMap& map, ArchiveFile& archive) {
  return with_whole(map, archive, digest_to(archive));
}

/// The memory of a map of which the archive has all is the cache.
Outcome<MapSummary> save_archived(LocalMap& map, ArchiveFile& archive, const MapIdentity& identity,
                                  const std::string& path) {
  MapAndArchive both(map, archive.blocks());
  std::vector<KeyedIndex> workspace(2 * archive.blocks().index().size());
  const auto blocks = archive.blocks().index().blocks_in_order(workspace);
  WholeMap whole(map, map.revision(), {}, both.archive());
  return save_to(archive, identity, path)(map, blocks, whole.lookup());
}

MapSnapshot::MapSnapshot(const LocalMap& map, const ArchiveFile& archive)
    : archive_(archive),
      config_(map.config()),
      classes_(map.classes()),
      revision_(map.revision()),
      archived_(2 * archive.blocks().index().size()),
      buffer_(most_block_bytes(map.num_components()) + sizeof(std::uint32_t)) {
  archived_.resize(archive.blocks().index().blocks_in_order(archived_).size());
}

Outcome<std::unique_ptr<MapSnapshot>> MapSnapshot::take(const LocalMap& map,
                                                        const ArchiveFile& archive,
                                                        const std::string& beside) {
  std::unique_ptr<MapSnapshot> snapshot(new MapSnapshot(map, archive));
  TESSERA_TRY(snapshot->copy(map, beside));
  return snapshot;
}

Outcome<void> MapSnapshot::copy(const LocalMap& map, const std::string& beside) {
  TESSERA_TRY_ASSIGN(FileDescriptor file, nameless_file(beside));
  file_ = std::move(file);
  std::vector<std::byte> pending;
  pending.reserve(kCopyBytes);
  const auto write = [&] {
    std::span<const std::byte> rest(pending);
    while (!rest.empty()) {
      const ssize_t n = ::write(file_.get(), rest.data(), rest.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) return false;
      rest = rest.subspan(static_cast<std::size_t>(n));
    }
    pending.clear();
    return true;
  };
  std::uint64_t offset = 0;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  copied_.reserve(map.block_count());
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    const std::size_t bytes = save_block(map, map.block_at(item.index), buffer_);
    if (pending.size() + bytes > kCopyBytes && !write())
      return system_failure("write", "the copy of the map beside " + beside, errno,
                            FailureKind::kFailure);
    pending.insert(pending.end(), buffer_.begin(),
                   buffer_.begin() + static_cast<std::ptrdiff_t>(bytes));
    copied_.push_back({item.key, offset, static_cast<std::uint32_t>(bytes)});
    offset += bytes;
  }
  if (!write())
    return system_failure("write", "the copy of the map beside " + beside, errno,
                          FailureKind::kFailure);
  return {};
}

Status MapSnapshot::add_copied(BlockKey key, LocalMap& into) {
  const Copied* const at = find_in(copied_, key);
  if (at == nullptr || at->bytes == 0) return Status::kOk;
  const std::span<std::byte> bytes = std::span(buffer_).first(at->bytes);
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::pread(file_.get(), bytes.data() + done, bytes.size() - done,
                              static_cast<off_t>(at->offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Status::kIo;
    done += static_cast<std::size_t>(n);
  }
  return restore_block(bytes, into).status;
}

Status MapSnapshot::add_archived(BlockKey key, LocalMap& into) {
  const KeyedIndex* const at = find_in(archived_, key);
  if (at == nullptr) return Status::kOk;
  const std::size_t bytes = archive_.read_at_place(key, at->index, buffer_);
  return bytes == 0 ? Status::kIo : restore_block(std::span(buffer_).first(bytes), into).status;
}

Outcome<MapSummary> MapSnapshot::save(const MapIdentity& identity, const std::string& path) {
  TESSERA_TRY_ASSIGN(Cache cache, make_cache(config_, classes_));
  std::vector<KeyedIndex> blocks;
  blocks.reserve(copied_.size() + archived_.size());
  for (const Copied& copied : copied_) blocks.push_back({copied.key, 0});
  const auto middle = static_cast<std::ptrdiff_t>(blocks.size());
  blocks.insert(blocks.end(), archived_.begin(), archived_.end());
  const auto is_before = [](const KeyedIndex& a, const KeyedIndex& b) { return a.key < b.key; };
  const auto is_same = [](const KeyedIndex& a, const KeyedIndex& b) { return a.key == b.key; };
  std::inplace_merge(blocks.begin(), blocks.begin() + middle, blocks.end(), is_before);
  blocks.erase(std::unique(blocks.begin(), blocks.end(), is_same), blocks.end());
  WholeMap whole(
      cache.map, revision_,
      {this, [](void* self, BlockKey key,
                LocalMap& into) { return static_cast<MapSnapshot*>(self)->add_copied(key, into); }},
      {this, [](void* self, BlockKey key, LocalMap& into) {
         return static_cast<MapSnapshot*>(self)->add_archived(key, into);
       }});
  return save_to(archive_, identity, path)(cache.map, blocks, whole.lookup());
}

}  // namespace tessera
