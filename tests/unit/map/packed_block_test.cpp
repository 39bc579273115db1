// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Packed blocks: what goes in comes out, packing again gives the same bytes, and bytes that are no
// packed block are refused.
#include "tessera/map/internal/packed_block.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "support/random.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

using oracle::Random;

constexpr int kClasses = 6;
constexpr int kComponents = kClasses + 2;

/// A content with memory of its own.
struct OwnContent {
  OwnContent() : memory(BlockContent::required_bytes(kComponents)) {
    Arena arena = memory.arena();
    content = *BlockContent::make(arena, kComponents);
  }
  AlignedMemory memory;
  BlockContent content;
};

void fill(BlockContent& content, Random& random, int voxels) {
  for (int i = 0; i < voxels; ++i) {
    const int row = random.below(kBlockVoxels);
    for (int n = random.below(4); n > 0; --n)
      content.add(1 + random.below(kClasses + 1), row,
                  static_cast<float>(random.uniform(0.0002, 90.0)));
    if (random.below(5) == 0) {
      content.add_rest(row, static_cast<float>(random.uniform(0.01, 2.0)));
      content.set_centroid(row, Centroid::of_code(static_cast<std::uint8_t>(1 + row % 216)));
    }
    if (random.below(3) == 0)
      content.add_passes(row, 1U + static_cast<unsigned>(random.below(255)));
  }
  if (random.below(2) == 0) {
    for (int row = 0; row < 128; ++row) content.add_passes(row, 7);
  }
}

std::vector<std::byte> packed(const BlockContent& content) {
  std::vector<std::byte> bytes(most_packed_bytes(kComponents));
  bytes.resize(pack_block(content, bytes));
  return bytes;
}

void unpack_into(std::span<const std::byte> bytes, BlockContent& content) {
  unpack_block(
      bytes,
      [&](int row, Centroid centroid) {
        if (centroid.known()) content.set_centroid(row, centroid);
      },
      [&](int row, int component, float count) {
        component == 0 ? content.add_rest(row, count) : content.add(component, row, count);
      },
      [&](int row, unsigned passes) { content.add_passes(row, passes); });
}

TEST_CASE("packed block: what goes in comes out, to 2^-18 of each count, passes are exact") {
  Random random(static_cast<std::uint64_t>(GENERATE(1, 2, 3, 4, 5)));
  OwnContent given;
  fill(given.content, random, random.below(200));
  const std::vector<std::byte> bytes = packed(given.content);
  OwnContent found;
  unpack_into(bytes, found.content);
  for (int row = 0; row < kBlockVoxels; ++row) {
    REQUIRE(found.content.centroid(row) == given.content.centroid(row));
    for (int l = 1; l < kComponents; ++l) {
      const float count = given.content.count(l, row);
      REQUIRE(std::fabs(found.content.count(l, row) - count) <= count * 0x1p-18F);
    }
    REQUIRE(std::fabs(found.content.rest(row) - given.content.rest(row)) <=
            given.content.rest(row) * 0x1p-18F);
    const unsigned passes = given.content.passes(row);
    REQUIRE(found.content.passes(row) == (passes < 255U ? passes : 255U));
  }
  CHECK(packed(found.content) == bytes);
  if (!bytes.empty()) CHECK(check_packed(bytes, kComponents) == Status::kOk);
}

TEST_CASE("packed block: nothing takes no bytes, and too little room gives none") {
  OwnContent own;
  CHECK(packed(own.content).empty());
  own.content.add(1, 17, 2.0F);
  own.content.set_centroid(17, Centroid::of_code(216));
  own.content.add_passes(300, 3);
  const std::vector<std::byte> bytes = packed(own.content);
  // Two masks, one octet's voxels, which centroids are known, one of these and an entry, the
  // uniform octets and one with eight passes.
  CHECK(bytes.size() == 16 + 1 + 1 + 1 + 4 + 8 + 8);
  std::vector<std::byte> less(bytes.size());
  for (std::size_t size = 0; size < bytes.size(); ++size)
    CHECK(pack_block(own.content, std::span(less).first(size)) == 0);
  own.content.clear();
  CHECK_FALSE(own.content.any());
  CHECK(packed(own.content).empty());
}

TEST_CASE("packed block: counts end at the ceiling, and under the floor there are none") {
  OwnContent own;
  own.content.add(1, 0, 3.4e38F);
  own.content.add(2, 0, kLeastCount);
  own.content.add(3, 0, std::nextafter(kLeastCount, 0.0F));
  own.content.add(4, 0, 1e-39F);
  own.content.add(5, 0, kLargestCount);
  OwnContent found;
  unpack_into(packed(own.content), found.content);
  CHECK(found.content.count(1, 0) == kLargestCount);
  CHECK(found.content.count(2, 0) == kLeastCount);
  CHECK(found.content.count(3, 0) == 0.0F);
  CHECK(found.content.count(4, 0) == 0.0F);
  CHECK(found.content.count(5, 0) == kLargestCount);
}

TEST_CASE("packed block: a block of which all counts are under the floor is none") {
  OwnContent own;
  own.content.add(1, 0, 1e-39F);
  CHECK(packed(own.content).empty());
}

TEST_CASE("packed block: a centroid that is none, or of a voxel without labels, is refused") {
  OwnContent own;
  own.content.add(1, 0, 1.0F);
  own.content.set_centroid(0, Centroid::of_code(1));
  const std::vector<std::byte> good = packed(own.content);
  REQUIRE(good.size() == 16 + 1 + 1 + 1 + 4);
  const auto status_with = [&](std::size_t at, unsigned value) {
    std::vector<std::byte> bytes = good;
    bytes[at] = static_cast<std::byte>(value);
    return check_packed(bytes, kComponents);
  };
  CHECK(status_with(18, 216) == Status::kOk);
  CHECK(status_with(18, 0) == Status::kCorrupt);
  CHECK(status_with(18, 217) == Status::kCorrupt);
  CHECK(status_with(17, 3) == Status::kCorrupt);
  CHECK(status_with(17, 0) == Status::kCorrupt);  // then its byte is no count
}

TEST_CASE("packed block: bytes with a count outside of floor and ceiling are refused") {
  OwnContent own;
  own.content.add(1, 0, 1.0F);
  std::vector<std::byte> bytes = packed(own.content);
  REQUIRE(bytes.size() == 16 + 1 + 1 + 4);
  const auto status_with = [&](std::uint32_t bits) {
    const std::uint32_t entry = std::uint32_t{1} << 31U | std::uint32_t{1} << 25U | bits;
    std::memcpy(&bytes[18], &entry, sizeof(entry));
    return check_packed(bytes, kComponents);
  };
  const std::uint32_t least = std::bit_cast<std::uint32_t>(kLeastCount) >> 6U;
  const std::uint32_t largest = std::bit_cast<std::uint32_t>(kLargestCount) >> 6U;
  CHECK(status_with(least) == Status::kOk);
  CHECK(status_with(largest) == Status::kOk);
  CHECK(status_with(least - 1) == Status::kCorrupt);
  CHECK(status_with(largest + 1) == Status::kCorrupt);
  CHECK(status_with(1) == Status::kCorrupt);  // a subnormal
}

TEST_CASE(
    "packed block: every truncation, and random damage that is accepted, stays within bounds") {
  Random random(7);
  OwnContent given;
  fill(given.content, random, 60);
  const std::vector<std::byte> bytes = packed(given.content);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::vector<std::byte> cut(bytes.begin(),
                                     bytes.begin() + static_cast<std::ptrdiff_t>(size));
    REQUIRE(check_packed(cut, kComponents) == Status::kCorrupt);
  }
  int accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::byte> damaged = bytes;
    for (int n = 1 + random.below(3); n > 0; --n) {
      auto& byte = damaged[static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())))];
      byte = static_cast<std::byte>(random.bits() & 0xffU);
    }
    if (check_packed(damaged, kComponents) != Status::kOk) continue;
    ++accepted;
    OwnContent found;
    unpack_into(damaged, found.content);
    // What is accepted is what packing would have written.
    REQUIRE(packed(found.content) == damaged);
  }
  CHECK(accepted > 100);
}

TEST_CASE("replace: a block holds what it is given and nothing else, and can be packed again") {
  const TuplePolicy tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  MapConfig config = config_of_pages(64);
  config.tuple = tuple;
  config.max_evidence = 0.0F;
  SmallMap small(config, kClasses);
  Random random(11);
  for (int round = 0; round < 20; ++round) {
    OwnContent given;
    fill(given.content, random, random.below(80));
    const SlabHandle block = *small.map.open_block({3, -2, 5});
    REQUIRE(small.map.replace(block, given.content) == Status::kOk);
    OwnContent found;
    add_block(small.map, small.map.block_at(block), found.content);
    for (int row = 0; row < kBlockVoxels; ++row) {
      float sum = 0.0F;
      float expected = given.content.rest(row);
      float rest = found.content.rest(row);
      for (int l = 1; l < kComponents; ++l) {
        sum += found.content.count(l, row);
        expected += given.content.count(l, row);
        if (tuple == TuplePolicy::kDense && l <= kClasses)
          REQUIRE(found.content.count(l, row) == given.content.count(l, row));
      }
      // Compact: to half a quantum a count.
      REQUIRE(std::fabs(sum + rest - expected) <= 4.0F / 4096.0F + expected * 1e-6F);
      const unsigned passes = given.content.passes(row);
      REQUIRE(found.content.passes(row) == (passes < 255U ? passes : 255U));
    }
    small.map.close_if_empty(block);
  }
}

TEST_CASE("replace: where there is no room the block holds nothing, and the refusal is counted") {
  MapConfig config = config_of_pages(4);
  SmallMap small(config, kClasses);
  Random random(13);
  OwnContent given;
  fill(given.content, random, 200);
  const SlabHandle block = *small.map.open_block({0, 0, 0});
  REQUIRE(hit(small.map, {1, 1, 1}, 2, 1.0F) == Status::kOk);
  CHECK(small.map.replace(block, given.content) == Status::kResourceExhausted);
  CHECK(small.map.usage().storage_refused == 1);
  CHECK(small.map.usage().label_voxels == 0);
  CHECK(small.map.count_free_voxels() == 0);
}

}  // namespace
}  // namespace tessera
