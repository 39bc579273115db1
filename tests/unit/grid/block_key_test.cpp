// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks, octets and voxels: keys hold every block of the grid in (z, y, x) order, and the parts of
// a block number its 512 voxels without gap or overlap.
#include <array>
#include <catch2/catch.hpp>
#include <tuple>

#include "support/random.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {
namespace {

constexpr std::array<std::int32_t, 7> kTelling{-kBlockLimit,    -kBlockLimit + 1, -1, 0, 1,
                                               kBlockLimit - 2, kBlockLimit - 1};

BlockCoord random_block(oracle::Random& random) {
  const auto one = [&] { return random.below(2 * kBlockLimit) - kBlockLimit; };
  const std::int32_t x = one();
  const std::int32_t y = one();
  return {x, y, one()};
}

TEST_CASE("pack: unpack gives the block back, up to the limits of the grid") {
  for (const std::int32_t x : kTelling) {
    for (const std::int32_t y : kTelling) {
      for (const std::int32_t z : kTelling) {
        const Result<BlockKey> key = pack({x, y, z});
        REQUIRE(key.ok());
        REQUIRE(unpack(*key) == BlockCoord{x, y, z});
        REQUIRE(pack_in_grid({x, y, z}) == *key);
      }
    }
  }
}

TEST_CASE("pack: a block outside the grid is refused, on whichever axis") {
  static_assert(kBlockLimit == 1 << 20);
  for (const std::int32_t bad : {-kBlockLimit - 1, kBlockLimit, -2147483647 - 1, 2147483647}) {
    CHECK(pack({bad, 0, 0}).status() == Status::kOutOfRange);
    CHECK(pack({0, bad, 0}).status() == Status::kOutOfRange);
    CHECK(pack({0, 0, bad}).status() == Status::kOutOfRange);
  }
}

TEST_CASE("pack: keys leave the top bit free") {
  CHECK(pack_in_grid({kBlockLimit - 1, kBlockLimit - 1, kBlockLimit - 1}).bits ==
        0x7fffffffffffffffU);
  CHECK(pack_in_grid({-kBlockLimit, -kBlockLimit, -kBlockLimit}).bits == 0);
}

TEST_CASE("pack: keys compare as (z, y, x) does, across zero too") {
  constexpr std::uint64_t kSeed = 7;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (int round = 0; round < 20000; ++round) {
    const BlockCoord a = random_block(random);
    BlockCoord b = random_block(random);
    if (round % 3 == 0) b.z = a.z;
    if (round % 3 == 0 && round % 2 == 0) b.y = a.y;
    REQUIRE((pack_in_grid(a) < pack_in_grid(b)) ==
            (std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x)));
  }
  CHECK(pack_in_grid({5, 5, -1}) < pack_in_grid({-5, -5, 0}));
  CHECK(pack_in_grid({5, -1, 0}) < pack_in_grid({-5, 0, 0}));
  CHECK(pack_in_grid({-1, 0, 0}) < pack_in_grid({0, 0, 0}));
}

TEST_CASE("block_of: floors, so that the blocks beside zero are as large as all others") {
  CHECK(block_of({0, 7, 8}) == BlockCoord{0, 0, 1});
  CHECK(block_of({-1, -8, -9}) == BlockCoord{-1, -1, -2});
  CHECK(block_of({-kVoxelLimit, 0, kVoxelLimit - 1}) ==
        BlockCoord{-kBlockLimit, 0, kBlockLimit - 1});
}

TEST_CASE("octet_in_block and voxel_in_octet: number a block's voxels without gap or overlap") {
  for (const BlockCoord block : {BlockCoord{0, 0, 0}, BlockCoord{-1, -2, 3},
                                 BlockCoord{-kBlockLimit, kBlockLimit - 1, -1}}) {
    std::array<int, kBlockVoxels> seen{};
    for (int i = 0; i < kBlockVoxels; ++i) {
      const VoxelCoord v{block.x * 8 + i % 8, block.y * 8 + i / 8 % 8, block.z * 8 + i / 64};
      REQUIRE(block_of(v) == block);
      const int octet = octet_in_block(v);
      const int voxel = voxel_in_octet(v);
      REQUIRE((octet >= 0 && octet < kBlockOctets && voxel >= 0 && voxel < kOctetVoxels));
      ++seen[static_cast<std::size_t>(octet * kOctetVoxels + voxel)];
      REQUIRE(voxel_at(block, octet, voxel) == v);
    }
    CHECK(seen == [] {
      std::array<int, kBlockVoxels> once{};
      once.fill(1);
      return once;
    }());
  }
}

TEST_CASE("octet_in_block: the eight voxels of an octet are neighbours") {
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const VoxelCoord corner = voxel_at({-1, -1, -1}, octet, 0);
    for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
      const VoxelCoord v = voxel_at({-1, -1, -1}, octet, voxel);
      CHECK((v.x - corner.x == (voxel & 1) && v.y - corner.y == ((voxel >> 1) & 1) &&
             v.z - corner.z == ((voxel >> 2) & 1)));
    }
  }
}

TEST_CASE("row_order: runs x fastest, then y, then z") {
  for (int i = 0; i < kBlockVoxels; ++i) {
    const VoxelCoord v{i % 8, i / 8 % 8, i / 64};
    CHECK(row_order(octet_in_block(v), voxel_in_octet(v)) == i);
  }
  CHECK(row_order_corner(0) == 0);
  CHECK(row_order_corner(kBlockOctets - 1) == 6 + 8 * (6 + 8 * 6));
}

}  // namespace
}  // namespace tessera
