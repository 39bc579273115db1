// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/stored_archive.hpp"

#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/put_in_place.hpp"

namespace tessera {

/// The archive as mappers call it. Named, so that the gate of the stack knows who calls them.
struct ArchiveCalls {
  static bool evict(void* archive, const LocalMap& map, const Block& block) {
    return static_cast<StoredArchive*>(archive)->evict(map, block);
  }
  static const RegionMask* archived(void* archive, BlockCoord region) {
    return static_cast<const StoredArchive*>(archive)->index().archived(region);
  }
  static Status reload(void* archive, LocalMap& map, BlockKey key) {
    return static_cast<StoredArchive*>(archive)->reload(map, key);
  }
  static void clear(void* archive) { static_cast<StoredArchive*>(archive)->clear(); }
};

Result<StoredArchive*> StoredArchive::make(Arena& arena, const MapConfig& map,
                                           const ClassTable& classes, std::size_t blocks,
                                           const BlockStore& store) noexcept {
  if (store.put == nullptr || store.get == nullptr) return Status::kInvalidArgument;
  const std::span<StoredArchive> place = arena.take<StoredArchive>(1);
  if (place.empty()) return Status::kResourceExhausted;
  StoredArchive& archive = place.front();
  const int components = classes.num_components();
  Status status =
      LocalMap::make_at(archive.one_block_, arena, one_block_config(map, components), classes);
  if (status == Status::kOk)
    status = put_in_place(archive.index_, [&] { return ArchiveIndex::make(arena, blocks); });
  if (status != Status::kOk) return status;
  archive.write_ = arena.take<std::byte>(most_block_bytes(components));
  archive.read_ = arena.take<std::byte>(most_block_bytes(components));
  if (archive.read_.empty()) return Status::kResourceExhausted;
  archive.store_ = store;
  return &archive;
}

BlockArchive StoredArchive::interface() noexcept {
  return {.context = this,
          .evict = &ArchiveCalls::evict,
          .archived = &ArchiveCalls::archived,
          .reload = &ArchiveCalls::reload,
          .clear = &ArchiveCalls::clear};
}

bool StoredArchive::evict(const LocalMap& map, const Block& block) noexcept {
  const BlockKey key{block.key};
  std::size_t bytes = save_block(map, block, write_);
  if (bytes == 0) return true;  // without evidence there is nothing to keep
  const bool archived = index_.find(key).has_value();
  if (archived) {
    one_block_.clear();
    if (read_into(one_block_, key) != Status::kOk ||
        !restore_block(write_.first(bytes), one_block_).ok())
      return false;
    bytes = save_block(one_block_, *one_block_.find(unpack(key)), write_);
  } else if (!index_.open(key)) {
    ++counts_.no_index;
    return false;
  }
  if (!put(key, write_.first(bytes))) {
    ++counts_.not_written;
    if (!archived) index_.erase(key);
    return false;
  }
  counts_.evictions_merged += archived ? 1U : 0U;
  return true;
}

bool StoredArchive::put(BlockKey key, std::span<const std::byte> bytes) noexcept {
  std::uint32_t place = index_.find(key).value_or(0);
  if (!store_.put(store_.context, key, bytes, place)) return false;
  index_.assign(key, place);
  return true;
}

std::span<const std::byte> StoredArchive::get(BlockKey key) noexcept {
  const std::optional<std::uint32_t> place = index_.find(key);
  if (!place) return {};
  const std::size_t bytes = store_.get(store_.context, key, *place, read_);
  return bytes <= read_.size() ? read_.first(bytes) : std::span<std::byte>{};
}

/// Bytes of another block would be added to that one.
Status StoredArchive::read_into(LocalMap& map, BlockKey key) noexcept {
  const std::span<const std::byte> bytes = get(key);
  const bool is_its = bytes.size() > 8 && ByteReader(bytes).u64() == key.bits;
  const Status status = is_its ? restore_block(bytes, map).status : Status::kIo;
  if (status != Status::kOk && status != Status::kResourceExhausted) ++counts_.not_read;
  return status;
}

Status StoredArchive::reload(LocalMap& map, BlockKey key) noexcept {
  const Status status = read_into(map, key);
  if (status != Status::kOk) return status;
  if (store_.drop != nullptr) store_.drop(store_.context, key, index_.find(key).value_or(0));
  index_.erase(key);
  return status;
}

Status StoredArchive::copy(const LocalMap& from, const Block& block, LocalMap& into) noexcept {
  const std::size_t bytes = save_block(from, block, write_);
  return bytes == 0 ? Status::kOk : restore_block(write_.first(bytes), into).status;
}

bool StoredArchive::list(BlockKey key, std::uint32_t place) noexcept {
  if (!index_.open(key)) return false;
  index_.assign(key, place);
  return true;
}

void StoredArchive::clear() noexcept {
  index_.clear();
  if (store_.clear != nullptr) store_.clear(store_.context);
}

}  // namespace tessera
