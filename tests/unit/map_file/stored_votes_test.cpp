// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Votes in stored blocks and map files: they come back as they were, are added where there are
// some, and nothing that no map can have is taken.
#include <catch2/catch.hpp>
#include <functional>
#include <map>

#include "stored_bytes.hpp"
#include "support/small_map.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"
#include "tessera/map/map_reader.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera {
namespace {

MapConfig voting(bool votes = true) {
  MapConfig config = config_of_pages(64);
  config.label_votes = votes;
  return config;
}

StoredBytes block_of(const LocalMap& map) {
  StoredBytes bytes(most_block_bytes(map.num_components()));
  bytes.resize(save_block(map, *map.find(BlockCoord{0, 0, 0}), bytes));
  return bytes;
}

/// By cell and class, whatever slots they are in.
using Counts = std::map<std::pair<std::size_t, int>, int>;
Counts votes_in(const LocalMap& map, std::size_t layer) {
  const LabelVotes& votes = map.votes(*map.find(BlockCoord{0, 0, 0}), layer);
  Counts found;
  for (std::size_t s = 0; s < LabelVotes::kClasses; ++s)
    for (std::size_t cell = 0; cell < LabelVotes::kCells; ++cell)
      if (votes.votes[s][cell] != 0) found[{cell, votes.labels[s]}] += votes.votes[s][cell];
  return found;
}

/// A label in the lowest layer's first octet, and votes that do not follow from it.
void vote(LocalMap& map, int label, std::vector<std::pair<int, std::uint32_t>> votes,
          VoxelCoord voxel = {0, 0, 0}) {
  REQUIRE(hit(map, voxel, label, 2.0F) == Status::kOk);
  const SlabHandle block = map.find_handle(BlockCoord{0, 0, 0});
  const std::size_t layer = layer_of_octet(octet_in_block(voxel));
  LabelVotes of_layer = map.votes(map.block_at(block), layer);
  of_layer.begun = true;
  for (const auto& [of, count] : votes)
    of_layer.add(LabelVotes::cell_of_octet(octet_in_block(voxel)), static_cast<std::uint8_t>(of),
                 count);
  map.set_votes(block, layer, of_layer);
}

}  // namespace

TEST_CASE("stored votes: they come back as they were, and are stored as the same bytes again") {
  SmallMap there(voting(), 6);
  vote(there.map, 1, {{5, 40}, {1, 7}, {3, 4096}, {3, 4000}});
  vote(there.map, 2, {}, {7, 7, 7});                           // begun, but of no point
  REQUIRE(hit(there.map, {0, 0, 3}, 2, 1.0F) == Status::kOk);  // a layer that has not begun
  SmallMap here(voting(), 6);
  REQUIRE(restore_block(block_of(there.map), here.map).ok());
  CHECK(votes_in(here.map, 0) == Counts{{{0, 1}, 7}, {{0, 3}, 8096}, {{0, 5}, 40}});
  const Block& block = *here.map.find(BlockCoord{0, 0, 0});
  CHECK(here.map.votes(block, 0).begun);
  CHECK_FALSE(here.map.votes(block, 1).begun);
  CHECK(here.map.votes(block, 3).begun);
  CHECK(votes_in(here.map, 3).empty());
  CHECK(block_of(here.map) == block_of(there.map));
}

TEST_CASE("stored votes: what meets votes is added to them, and its labels do not vote again") {
  SmallMap there(voting(), 6);
  vote(there.map, 1, {{1, 100}, {2, 10}});
  SmallMap here(voting(), 6);
  vote(here.map, 2, {{2, 30}, {4, 5}});
  REQUIRE(restore_block(block_of(there.map), here.map).ok());
  CHECK(votes_in(here.map, 0) == Counts{{{0, 1}, 100}, {{0, 2}, 40}, {{0, 4}, 5}});
}

TEST_CASE("stored votes: labels without votes here begin to vote before others' votes are added") {
  SmallMap there(voting(), 6);
  vote(there.map, 1, {{1, 100}});
  SmallMap here(voting(), 6);
  REQUIRE(hit(here.map, {0, 0, 0}, 2, 3.0F) == Status::kOk);
  REQUIRE(restore_block(block_of(there.map), here.map).ok());
  CHECK(votes_in(here.map, 0) == Counts{{{0, 1}, 100}, {{0, 2}, 6}});
}

TEST_CASE("stored votes: a map without votes takes the labels alone") {
  SmallMap there(voting(), 6);
  vote(there.map, 1, {{1, 100}});
  SmallMap here(voting(false), 6);
  REQUIRE(restore_block(block_of(there.map), here.map).ok());
  CHECK(content_of(here.map) == content_of(there.map));
  SmallMap plain(voting(false), 6);
  REQUIRE(hit(plain.map, {0, 0, 0}, 1, 2.0F) == Status::kOk);
  CHECK(block_of(here.map) == block_of(plain.map));
}

TEST_CASE("stored votes: a block that another thread has read is stored with its votes") {
  SmallMap small(voting(), 6);
  vote(small.map, 1, {{1, 100}, {4, 3}});
  MapReader reader(small.map);
  std::vector<std::uint64_t> workspace((reader.snapshot_bytes() + 7) / 8);
  const Result<BlockSnapshot> read =
      reader.snapshot({0, 0, 0}, std::as_writable_bytes(std::span(workspace)));
  REQUIRE(read.ok());
  StoredBytes bytes(most_block_bytes(small.map.num_components()));
  bytes.resize(save_block(*read, bytes));
  CHECK(bytes == block_of(small.map));
}

TEST_CASE("stored votes: readers see a block as changed when its votes are") {
  SmallMap small(voting(), 6);
  vote(small.map, 1, {{1, 100}});
  const SlabHandle block = small.map.find_handle(BlockCoord{0, 0, 0});
  const std::uint64_t before = small.map.block_at(block).stamp;
  small.map.set_votes(block, 0, small.map.begun_votes(block, 0));
  CHECK(small.map.block_at(block).stamp > before);
}

TEST_CASE("stored votes: a map file has them, and its header says so") {
  SmallMap there(voting(), 6);
  vote(there.map, 1, {{1, 100}, {6, 1}});
  const StoredBytes file = stored(there.map);
  const std::unique_ptr<LoadedMap> here = loaded(file);
  CHECK(here->map.keeps_votes());
  CHECK(here->map.reading().around() == Reading::kAround);
  CHECK(votes_in(here->map, 0) == votes_in(there.map, 0));
  CHECK(stored(here->map) == file);
  const StoredBytes unannounced =
      with_header(file, [](StoredBytes& bytes) { bytes[kBodyOffset + 1] &= std::byte{0xbf}; });
  SmallMap refused(voting(), 6);
  CHECK(read_into(unannounced, refused.map).status == Status::kCorrupt);
}

TEST_CASE("stored votes: a map that keeps none writes the file of one that was never asked") {
  SmallMap small(voting(false), 6);
  REQUIRE(hit(small.map, {0, 0, 0}, 1, 2.0F) == Status::kOk);
  const std::unique_ptr<LoadedMap> here = loaded(stored(small.map));
  CHECK_FALSE(here->map.keeps_votes());
  CHECK(here->map.reading().around() == 0.0);
}

TEST_CASE("stored votes: what no map can have is refused, and changes nothing") {
  SmallMap there(voting(), 6);
  vote(there.map, 1, {{2, 100}, {5, 7}});
  const StoredBytes sound = block_of(there.map);
  constexpr std::size_t kParts = 12;
  constexpr std::size_t kHead = 21;
  constexpr std::size_t kVotes = kHead + 4;  // 1 count; 2 x (class, 4 x 2 bytes)
  constexpr std::size_t kClass = 9;
  REQUIRE(sound[kParts] == std::byte{0x10});
  REQUIRE(sound[kVotes] == std::byte{2});
  const auto changed = [&](const std::function<void(StoredBytes&)>& change) {
    StoredBytes bytes = sound;
    change(bytes);
    const auto put_crc = [&](std::size_t at, std::span<const std::byte> of) {
      ByteWriter(std::span(bytes).subspan(at, 4)).u32(crc32c(of));
    };
    put_crc(kHead, std::span(bytes).first(kHead));
    put_crc(bytes.size() - 4, std::span(bytes).subspan(kVotes, bytes.size() - kVotes - 4));
    SmallMap here(voting(), 6);
    const Status status = restore_block(bytes, here.map).status;
    if (status != Status::kOk) CHECK(content_of(here.map).evidence.empty());
    return status;
  };
  const auto u16_at = [](StoredBytes& bytes, std::size_t at, std::uint16_t value) {
    ByteWriter(std::span(bytes).subspan(at, 2)).u16(value);
  };
  CHECK(changed([](StoredBytes&) {}) == Status::kOk);
  SECTION("of a layer without labels") {
    CHECK(changed([](StoredBytes& b) { b[kParts] = std::byte{0x20}; }) == Status::kCorrupt);
  }
  SECTION("an unknown part of a block") {
    CHECK(changed([](StoredBytes& b) { b[kParts] = std::byte{0x12}; }) == Status::kCorrupt);
  }
  SECTION("of more classes than a layer can have") {
    CHECK(changed([](StoredBytes& b) { b[kVotes] = std::byte{6}; }) == Status::kCorrupt);
  }
  SECTION("of no class, of one that the map does not have, or of no known class") {
    for (const int label : {0, 7, 8})
      CHECK(changed([&](StoredBytes& b) {
              b[kVotes + 1 + (label > 0 ? kClass : 0)] = static_cast<std::byte>(label);
            }) == Status::kCorrupt);
  }
  SECTION("of a class twice, or of classes in another order") {
    for (const int label : {5, 6})
      CHECK(changed([&](StoredBytes& b) { b[kVotes + 1] = static_cast<std::byte>(label); }) ==
            Status::kCorrupt);
  }
  SECTION("a class without votes") {
    CHECK(changed([&](StoredBytes& b) { u16_at(b, kVotes + 2, 0); }) == Status::kCorrupt);
  }
  SECTION("more than a cell can have, all classes together") {
    constexpr std::uint16_t kMost = LabelVotes::kMostOfCell - 7;
    CHECK(changed([&](StoredBytes& b) { u16_at(b, kVotes + 2, kMost); }) == Status::kOk);
    CHECK(changed([&](StoredBytes& b) { u16_at(b, kVotes + 2, kMost + 1); }) == Status::kCorrupt);
  }
}

}  // namespace tessera
