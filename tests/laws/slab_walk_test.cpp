// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The walk that carves, against the brute-force slabs: random, axis-parallel, backward, diagonal
// and border-riding rays; and what admission rests on: a part of a ray stays in the whole ray's
// blocks.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <vector>

#include "oracle/carving_oracle.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"
#include "tessera/base/internal/bits.hpp"
#include "tessera/inference/internal/free_space.hpp"

namespace tessera::oracle {
namespace {

struct Ray {
  Vector a{};
  Vector b{};
};

/// Coordinates that lie on borders, on centres and anywhere, in turn.
Ray random_ray(Random& random, double reach) {
  const auto coordinate = [&] {
    const int whole = static_cast<int>(reach);
    const int kind = random.below(3);
    return kind == 0 ? static_cast<double>(random.below(2 * whole + 1) - whole)
                     : (kind == 1 ? random.below(4 * whole + 1) * 0.5 - reach
                                  : random.uniform(-reach, reach));
  };
  Ray ray{{coordinate(), coordinate(), coordinate()}, {coordinate(), coordinate(), coordinate()}};
  const int shape = random.below(6);
  for (std::size_t i = 0; i < 3; ++i) {
    if (shape < 3 && static_cast<int>(i) != shape) ray.b[i] = ray.a[i];  // along one axis
    if (shape == 3) ray.b[i] = ray.a[i] + (ray.b[0] - ray.a[0]) * (i == 1 ? -1.0 : 1.0);
  }
  return ray;
}

Point3d point_of(const Vector& v) { return {v[0], v[1], v[2]}; }

/// The voxels that a walk marks, by way of bitmaps as carving keeps them.
std::set<Voxel> marked_by(const SlabWalk& walk) {
  std::map<std::array<int, 3>, VoxelMask> blocks;
  const bool all = walk.walk<false>([&](BlockCoord c) { return blocks[{c.x, c.y, c.z}].data(); });
  CHECK(all);
  std::set<Voxel> voxels;
  const auto along = static_cast<std::size_t>(walk.axis());
  const std::array<int, 2> across = axes_across(walk.axis());
  for (const auto& [block, words] : blocks) {
    for (std::size_t i = 0; i < 512; ++i) {
      if (((words[i / 64] >> (i % 64)) & 1U) == 0) continue;
      Voxel voxel{block[0] * 8, block[1] * 8, block[2] * 8};
      voxel[along] += static_cast<std::int64_t>(i / 64);
      voxel[static_cast<std::size_t>(across[0])] += static_cast<std::int64_t>(i % 8);
      voxel[static_cast<std::size_t>(across[1])] += static_cast<std::int64_t>(i / 8 % 8);
      voxels.insert(voxel);
    }
  }
  return voxels;
}

std::set<std::array<int, 3>> blocks_asked_for(const SlabWalk& walk) {
  std::set<std::array<int, 3>> blocks;
  VoxelMask nowhere{};
  int asked = 0;
  CHECK(walk.walk<true>([&](BlockCoord c) {
    blocks.insert({c.x, c.y, c.z});
    ++asked;
    return nowhere.data();
  }));
  CHECK(static_cast<std::size_t>(asked) == blocks.size());  // none twice
  return blocks;
}

}  // namespace

TEST_CASE("slab walk: all voxels that a ray pierces, no others, and no more than it says") {
  Random random(announce_seed(45));
  for (int round = 0; round < 1500; ++round) {
    const Ray ray = random_ray(random, 4.0);
    CAPTURE(ray.a, ray.b);
    Pierced pierced;
    pierced.add(ray.a, ray.b, 1.0);
    const SlabWalk walk(point_of(ray.a), point_of(ray.b), 1.0);
    const std::set<Voxel> marked = marked_by(walk);
    int missing = 0;
    int extra = 0;
    for (const Voxel& voxel : pierced.certain) missing += marked.count(voxel) == 0 ? 1 : 0;
    for (const Voxel& voxel : marked) extra += pierced.possible.count(voxel) == 0 ? 1 : 0;
    CHECK(missing == 0);
    CHECK(extra == 0);
    CHECK(marked.size() <= walk.voxels());
    const double bound = std::abs(ray.b[0] - ray.a[0]) + std::abs(ray.b[1] - ray.a[1]) +
                         std::abs(ray.b[2] - ray.a[2]) + 4.0;
    CHECK(static_cast<double>(walk.voxels()) <= bound);
  }
}

TEST_CASE("slab walk: a part of a ray pierces what it should, and enters the whole ray's blocks") {
  Random random(announce_seed(46));
  for (int round = 0; round < 1500; ++round) {
    const Ray ray = random_ray(random, 21.0);
    const int kind = random.below(3);
    const double part =
        kind == 0 ? random.uniform(1e-6, 1.0) : (kind == 1 ? 0.5 : std::nextafter(1.0, 0.0));
    CAPTURE(ray.a, ray.b, part);
    const SlabWalk walk(point_of(ray.a), point_of(ray.b), part);
    const std::set<Voxel> marked = marked_by(walk);
    Vector end{};
    for (std::size_t i = 0; i < 3; ++i) end[i] = ray.a[i] + (ray.b[i] - ray.a[i]) * part;
    Pierced pierced;
    if (round % 10 == 0) {  // brute force over a box of 42 voxels a side
      pierced.add(ray.a, end, 1.0);
      for (const Voxel& voxel : pierced.certain) REQUIRE(marked.count(voxel) == 1);
      for (const Voxel& voxel : marked) REQUIRE(pierced.possible.count(voxel) == 1);
    }
    const auto blocks = blocks_asked_for(SlabWalk(point_of(ray.a), point_of(ray.b), 1.0));
    for (const Voxel& voxel : marked) {
      REQUIRE(blocks.count({static_cast<int>(voxel[0] >> 3), static_cast<int>(voxel[1] >> 3),
                            static_cast<int>(voxel[2] >> 3)}) == 1);
    }
  }
}

TEST_CASE(
    "slab walk: where there is no room for a block, it ends, having marked the blocks before") {
  Random random(announce_seed(48));
  for (int round = 0; round < 300; ++round) {
    const Ray ray = random_ray(random, 40.0);
    CAPTURE(ray.a, ray.b);
    const SlabWalk walk(point_of(ray.a), point_of(ray.b), 1.0);
    std::vector<std::array<int, 3>> order;
    std::map<std::array<int, 3>, VoxelMask> whole;
    REQUIRE(walk.walk<false>([&](BlockCoord c) {
      order.push_back({c.x, c.y, c.z});
      return whole[order.back()].data();
    }));
    CHECK(order.size() == whole.size());
    const auto room = static_cast<std::size_t>(random.below(static_cast<int>(order.size())));
    std::map<std::array<int, 3>, VoxelMask> some;
    std::size_t asked = 0;
    CHECK_FALSE(walk.walk<false>([&](BlockCoord c) {
      REQUIRE(order[asked] == std::array<int, 3>{c.x, c.y, c.z});
      return asked++ == room ? nullptr : some[{c.x, c.y, c.z}].data();
    }));
    CHECK(asked == room + 1);
    for (const auto& [block, words] : some) CHECK(words == whole.at(block));
  }
}

TEST_CASE("slab walk: a ray that ends on a face of the grid stays in the grid") {
  // The walk's steps are rounded. Where it comes into its last slab at its end, on a border of
  // voxels, their sum must not lead out of the grid.
  constexpr double kLowest = -kVoxelLimit;
  const double highest = std::nextafter(static_cast<double>(kVoxelLimit), 0.0);
  Random random(announce_seed(49));
  for (int round = 0; round < 20000; ++round) {
    const double reach = round % 2 == 0 ? 30.0 : 2000.0;
    const bool is_lower = round % 4 < 2;
    Point3d a;
    Point3d b;
    const auto to_border = [&](double v) { return random.below(2) == 0 ? std::round(v) : v; };
    for (int i = 0; i < 3; ++i) {
      // On the face, near it, or on an axis where the faces are far.
      const int kind = random.below(4);
      const double face = is_lower ? kLowest : highest;
      const double origin = kind == 0 ? 0.0 : face;
      const double inwards = is_lower ? 1.0 : -1.0;
      a[i] = origin + inwards * to_border(random.uniform(0.5, reach));
      b[i] = kind > 1 ? face : origin + inwards * to_border(random.uniform(0.0, reach));
    }
    CAPTURE(round, a, b);
    const auto count_outside = [](const SlabWalk& walk) {
      int outside = 0;
      VoxelMask nowhere{};
      CHECK(walk.for_blocks([&](BlockCoord block) {
        outside += in_grid(block) ? 0 : 1;
        return true;
      }));
      CHECK(walk.walk<true>([&](BlockCoord block) {
        outside += in_grid(block) ? 0 : 1;
        return nowhere.data();
      }));
      return outside;
    };
    REQUIRE(count_outside(SlabWalk(a, b, 1.0)) == 0);
    REQUIRE(count_outside(SlabWalk(a, b, std::nextafter(1.0, 0.0))) == 0);
    REQUIRE(count_outside(SlabWalk(a, b, random.uniform(1e-6, 1.0))) == 0);
  }
}

TEST_CASE("ray block: turning it keeps every voxel where it is") {
  Random random(announce_seed(47));
  RayBlock block;
  std::set<std::array<int, 3>> voxels;
  for (int i = 0; i < 100; ++i) {
    const std::array<int, 3> v{random.below(8), random.below(8), random.below(8)};
    voxels.insert(v);
    block.passed[static_cast<std::size_t>(v[2])] |= std::uint64_t{1}
                                                    << static_cast<unsigned>(v[0] + 8 * v[1]);
  }
  for (int turn = 0; turn < 60; ++turn) {
    const int axis = random.below(3);
    block.turn(axis);
    const std::array<int, 2> across = axes_across(axis);
    std::size_t found = 0;
    for (const std::array<int, 3>& v : voxels) {
      const int bit =
          v[static_cast<std::size_t>(across[0])] + 8 * v[static_cast<std::size_t>(across[1])];
      const std::uint64_t word =
          block.passed[static_cast<std::size_t>(v[static_cast<std::size_t>(axis)])];
      found += (word >> static_cast<unsigned>(bit)) & 1U;
    }
    CHECK(found == voxels.size());
    std::size_t set = 0;
    for (const std::uint64_t word : block.passed) set += static_cast<std::size_t>(count_ones(word));
    CHECK(set == voxels.size());
  }
}

}  // namespace tessera::oracle
