// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An archive over any store of bytes, and a map together with its archive read as one.
#include "tessera/map/stored_archive.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <vector>

#include "support/small_map.hpp"
#include "tessera/map/queries.hpp"
#include "tessera/map/whole_map.hpp"

namespace tessera {
namespace {

/// Keeps bytes in memory, under numbers that it gives out.
struct Bytes {
  std::map<std::uint32_t, std::vector<std::byte>> kept;
  std::uint32_t next = 1;
  bool is_full = false;
  bool is_damaged = false;

  BlockStore store() {
    return {
        .context = this,
        .put =
            [](void* context, BlockKey, std::span<const std::byte> bytes, std::uint32_t& place) {
              auto& self = *static_cast<Bytes*>(context);
              if (self.is_full) return false;
              self.kept.erase(place);
              place = self.next++;
              self.kept[place].assign(bytes.begin(), bytes.end());
              return true;
            },
        .get = [](void* context, BlockKey, std::uint32_t place,
                  std::span<std::byte> into) -> std::size_t {
          const auto& self = *static_cast<const Bytes*>(context);
          const std::vector<std::byte>& bytes = self.kept.at(place);
          std::copy(bytes.begin(), bytes.end(), into.begin());
          if (self.is_damaged) into[bytes.size() / 2] ^= std::byte{1};
          return bytes.size();
        },
        .drop = [](void* context, BlockKey,
                   std::uint32_t place) { static_cast<Bytes*>(context)->kept.erase(place); },
        .clear = [](void* context) { static_cast<Bytes*>(context)->kept.clear(); }};
  }
};

struct Held {
  explicit Held(const LocalMap& map, std::size_t blocks = 1024)
      : memory(StoredArchive::required_bytes(map.config(), map.num_components(), blocks)),
        archive(make(map, blocks)) {}
  Bytes bytes;
  AlignedMemory memory;
  StoredArchive& archive;

 private:
  StoredArchive& make(const LocalMap& map, std::size_t blocks) {
    Arena arena = memory.arena();
    StoredArchive* const made =
        *StoredArchive::make(arena, map.config(), map.classes(), blocks, bytes.store());
    CHECK(arena.remaining_bytes() == 0);
    return *made;
  }
};

/// A row of blocks along x, and some above it, with labels and free passes.
void fill(LocalMap& map, int from, int to) {
  for (int x = from; x < to; ++x) {
    for (int i = 0; i < 1 + x % 3; ++i)
      REQUIRE(hit(map, {8 * x + i, x % 5, 8 * (x % 2)}, 1 + x % 3,
                  0.5F + 0.25F * static_cast<float>(i)) == Status::kOk);
    REQUIRE(carve(map, {8 * x + 7, 7, 7}) == Status::kOk);
  }
}

void evict_all(LocalMap& map, StoredArchive& archive) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    REQUIRE(archive.evict(map, map.block_at(item.index)));
    map.remove_block(item.index);
  }
}

std::uint64_t digest_of(const LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  return digest(map, workspace);
}

std::vector<std::byte> file_of(const LocalMap& map, std::span<const KeyedIndex> blocks,
                               const BlockLookup& lookup) {
  std::vector<std::byte> file;
  const ByteSink sink{&file, [](void* context, std::span<const std::byte> bytes) {
                        auto& all = *static_cast<std::vector<std::byte>*>(context);
                        all.insert(all.end(), bytes.begin(), bytes.end());
                        return true;
                      }};
  MapFileBuffer buffer;
  CHECK(save(map, MapIdentity{}, blocks, lookup, buffer, sink).ok());
  return file;
}

std::vector<std::byte> file_of(LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  const BlockLookup lookup{&map, [](void* context, const KeyedIndex& item) {
                             return &static_cast<const LocalMap*>(context)->block_at(item.index);
                           }};
  return file_of(map, map.blocks_in_order(workspace), lookup);
}

TEST_CASE("StoredArchive: what leaves twice is kept as one, and comes back as it was") {
  SmallMap whole(config_of_pages(64));
  SmallMap map(config_of_pages(64));
  Held held(map.map);
  for (int part = 0; part < 3; ++part) {
    fill(whole.map, 0, 10);
    fill(map.map, 0, 10);
    evict_all(map.map, held.archive);
  }
  CHECK(held.archive.index().size() > 10);
  CHECK(held.archive.counts().evictions_merged == 2 * held.archive.index().size());
  CHECK(held.bytes.kept.size() == held.archive.index().size());
  std::vector<KeyedIndex> workspace(2 * held.archive.index().size());
  for (const KeyedIndex& item : held.archive.index().blocks_in_order(workspace))
    REQUIRE(held.archive.reload(map.map, BlockKey{item.key}) == Status::kOk);
  CHECK(held.bytes.kept.empty());
  CHECK(digest_of(map.map) == digest_of(whole.map));
}

TEST_CASE("StoredArchive: what the store refuses or damages changes nothing, and is counted") {
  SmallMap map(config_of_pages(64));
  fill(map.map, 0, 4);
  Held held(map.map);
  const Block& block = *map.map.find({0, 0, 0});
  held.bytes.is_full = true;
  CHECK_FALSE(held.archive.evict(map.map, block));
  CHECK(held.archive.counts().not_written == 1);
  CHECK(held.archive.index().size() == 0);
  held.bytes.is_full = false;
  REQUIRE(held.archive.evict(map.map, block));
  const Content before = content_of(map.map);
  held.bytes.is_damaged = true;
  CHECK(held.archive.reload(map.map, BlockKey{block.key}) != Status::kOk);
  CHECK_FALSE(held.archive.evict(map.map, block));
  CHECK(held.archive.counts().not_read == 2);
  CHECK(content_of(map.map) == before);
  CHECK(held.archive.index().size() == 1);
  held.archive.clear();
  CHECK(held.bytes.kept.empty());
  CHECK(held.archive.index().size() == 0);
}

TEST_CASE("StoredArchive: no more blocks than there is room for") {
  SmallMap map(config_of_pages(64));
  fill(map.map, 0, 20);
  Held held(map.map, 4);
  std::vector<KeyedIndex> workspace(2 * map.map.block_count());
  std::size_t taken = 0;
  for (const KeyedIndex& item : map.map.blocks_in_order(workspace))
    taken += held.archive.evict(map.map, map.map.block_at(item.index)) ? 1U : 0U;
  CHECK(taken == 4);
  CHECK(held.archive.counts().no_index == map.map.block_count() - 4);
}

TEST_CASE("WholeMap: map and archive have the file and the digest of a map that is whole") {
  const bool is_small = GENERATE(true, false);
  SmallMap whole(config_of_pages(64));
  SmallMap map(config_of_pages(64));
  Held held(map.map);
  // Blocks in the archive alone, in both, and in the map alone.
  for (const auto& [from, to, leaves] : {std::tuple{0, 12, true}, {8, 20, false}}) {
    fill(whole.map, from, to);
    fill(map.map, from, to);
    if (leaves) evict_all(map.map, held.archive);
  }
  const std::size_t one_block =
      one_block_storage(map.map.config().tuple, map.map.num_components()) / SlabPool::kPageBytes;
  SmallMap cache(config_of_pages(is_small ? one_block : 64));
  MapAndArchive both(map.map, held.archive);
  std::vector<KeyedIndex> workspace(both.workspace_entries());
  const std::span<const KeyedIndex> blocks = both.blocks_in_order(workspace);
  CHECK(blocks.size() == whole.map.block_count());
  WholeMap read(cache.map, whole.map.revision(), both.map(), both.archive());
  const Result<std::uint64_t> content = digest(cache.map, blocks, read.lookup());
  REQUIRE(content.ok());
  CHECK(*content == digest_of(whole.map));
  CHECK(file_of(cache.map, blocks, read.lookup()) == file_of(whole.map));
  held.bytes.is_damaged = true;
  WholeMap again(cache.map, whole.map.revision(), both.map(), both.archive());
  CHECK(digest(cache.map, blocks, again.lookup()).status() == Status::kIo);
}

}  // namespace
}  // namespace tessera
