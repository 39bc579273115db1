// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Phi: no holes, nothing lost, and block ranges that hold all that they should.
#include "tessera/replica/grid_transform.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <tuple>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

using oracle::Random;

std::tuple<int, int, int> key_of(VoxelCoord v) { return {v.x, v.y, v.z}; }

bool within(const GridTransform::BlockRange& range, BlockCoord b) {
  return b.x >= range.first.x && b.x <= range.last.x && b.y >= range.first.y &&
         b.y <= range.last.y && b.z >= range.first.z && b.z <= range.last.z;
}

TEST_CASE(
    "Phi: every global voxel inside gets evidence, every local voxel gives, 0 to 45 degrees") {
  const double degrees = GENERATE(0.0, 0.5, 5.0, 12.0, 30.0, 45.0);
  CAPTURE(degrees);
  Random random(oracle::announce_seed(61));
  const Matrix34d T = oracle::random_transform(random, degrees, 3.0);
  const GridTransform frame = *GridTransform::make(T, 0.1);
  constexpr int kEdge = 20;
  std::set<std::tuple<int, int, int>> reached;
  int lost = 0;
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        const VoxelCoord local{x, y, z};
        int targets = 0;
        frame.for_targets(local, [&](VoxelCoord target) {
          ++targets;
          reached.insert(key_of(target));
          REQUIRE(within(frame.global_blocks(block_of(local)), block_of(target)));
          REQUIRE(within(frame.local_blocks(block_of(target)), block_of(local)));
        });
        if (!frame.shift_only()) {
          const Centroid centroid = Centroid::of_levels({x % 6, y % 6, z % 6});
          frame.for_box_corners(local, centroid, [&](VoxelCoord target) {
            REQUIRE(within(frame.global_blocks(block_of(local)), block_of(target)));
            REQUIRE(within(frame.local_blocks(block_of(target)), block_of(local)));
          });
        }
        lost += targets == 0 ? 1 : 0;
        REQUIRE(targets <= 8);
      }
    }
  }
  CHECK(lost == 0);
  // Any global voxel whose centre lies in the solid cube of local ones.
  int holes = 0;
  int inside = 0;
  const auto [cx, cy, cz] = frame.to_global({kEdge / 2, kEdge / 2, kEdge / 2});
  for (int z = -20; z <= 20; ++z) {
    for (int y = -20; y <= 20; ++y) {
      for (int x = -20; x <= 20; ++x) {
        const VoxelCoord global{floor_to_int(cx) + x, floor_to_int(cy) + y, floor_to_int(cz) + z};
        const VoxelCoord local = frame.to_local(global);
        const auto in_cube = [](int v) { return v >= 0 && v < kEdge; };
        if (!in_cube(local.x) || !in_cube(local.y) || !in_cube(local.z)) continue;
        ++inside;
        holes += reached.contains(key_of(global)) ? 0 : 1;
      }
    }
  }
  CHECK(inside > kEdge * kEdge * kEdge * 9 / 10);
  CHECK(holes == 0);
}

TEST_CASE("Phi: the voxels of a block at once are those of one after the other") {
  Random random(oracle::announce_seed(62));
  std::vector<VoxelCoord> rows(kBlockVoxels);
  for (const double degrees : {0.5, 12.0, 90.0, 170.0}) {
    const GridTransform frame =
        *GridTransform::make(oracle::random_transform(random, degrees, 300.0), 0.1);
    REQUIRE(!frame.shift_only());
    for (int i = 0; i < 20; ++i) {
      const BlockCoord block{random.below(2001) - 1000, random.below(2001) - 1000,
                             random.below(2001) - 1000};
      frame.to_local(block, rows);
      for (int row = 0; row < kBlockVoxels; ++row)
        REQUIRE(rows[static_cast<std::size_t>(row)] == frame.to_local(voxel_of_row(block, row)));
    }
  }
}

TEST_CASE("Phi: a shift by whole voxels is one to one, and one by decimal metres is whole") {
  Matrix34d T = Matrix34d::Identity();
  T.col(3) = Point3d(0.3, -12.7, 4.0);
  const GridTransform frame = *GridTransform::make(T, 0.1);
  CHECK(frame.shift_only());
  CHECK(frame.to_local({10, 10, 10}) == VoxelCoord{7, 137, -30});
  T(0, 3) = 0.33;
  CHECK_FALSE(GridTransform::make(T, 0.1)->shift_only());
}

TEST_CASE("Phi: what is no rigid transform, or out of the grid, is refused") {
  Matrix34d T = Matrix34d::Identity();
  T(0, 0) = 2.0;
  CHECK(GridTransform::make(T, 0.1).status() == Status::kInvalidArgument);
  T = Matrix34d::Identity();
  T(2, 3) = 1e9;
  CHECK(GridTransform::make(T, 0.1).status() == Status::kInvalidArgument);
  T(2, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK(GridTransform::make(T, 0.1).status() == Status::kInvalidArgument);
}

TEST_CASE("Phi: a matrix that is a rotation to four digits is made one") {
  Random random(oracle::announce_seed(62));
  Matrix34d T = oracle::random_transform(random, 20.0, 1.0);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) T(i, j) = std::round(T(i, j) * 1e4) / 1e4;
  }
  const GridTransform frame = *GridTransform::make(T, 0.1);
  // Back and forth a kilometre away: a rotation that was not one would be metres off.
  for (int i = 0; i < 200; ++i) {
    const VoxelCoord local{random.below(20000) - 10000, random.below(20000) - 10000,
                           random.below(2000)};
    const auto [x, y, z] = frame.to_global(local);
    const VoxelCoord back =
        frame.to_local({floor_to_int(x), floor_to_int(y), floor_to_int(z)}) - local;
    REQUIRE(std::max({std::abs(back.x), std::abs(back.y), std::abs(back.z)}) <= 1);
  }
}

TEST_CASE("Phi: in a world that is placed, it is that of the product of both transforms") {
  Random random(oracle::announce_seed(64));
  for (int i = 0; i < 200; ++i) {
    const Matrix34d T_team_world = oracle::random_transform(random, 180.0, 50.0);
    const Matrix34d T_world_local = oracle::random_transform(random, 180.0, 50.0);
    const GridTransform local = *GridTransform::make(T_world_local, 0.1);
    const GridTransform placed = *GridTransform::compose(T_team_world, local, 0.1);
    const GridTransform expected = *GridTransform::make(product(T_team_world, T_world_local), 0.1);
    const VoxelCoord far{1000, -1000, 500};
    for (std::size_t axis = 0; axis < 3; ++axis)
      REQUIRE(placed.to_global(far)[axis] == Approx(expected.to_global(far)[axis]).margin(1e-8));
    // The identity moves nothing, not a bit of it.
    REQUIRE(*GridTransform::compose(Matrix34d::Identity(), local, 0.1) == local);
  }
}

TEST_CASE("Phi: whole voxels stay whole voxels in a world that is placed by whole voxels") {
  Matrix34d T = Matrix34d::Identity();
  T(0, 3) = 0.7;
  T(1, 3) = -1234.3;
  const GridTransform local = *GridTransform::make(T, 0.1);
  const GridTransform placed = *GridTransform::compose(T, local, 0.1);
  CHECK(placed.shift_only());
  CHECK((placed.shift() == VoxelCoord{14, -24686, 0}));
  T(1, 3) = -kBlockLimit * 0.1;
  CHECK(GridTransform::compose(T, local, 0.1).status() == Status::kInvalidArgument);
  T(1, 3) = 1e300;
  CHECK(GridTransform::compose(T, local, 0.1).status() == Status::kInvalidArgument);
  CHECK(GridTransform::compose(T, local, 0.0).status() == Status::kInvalidArgument);
}

}  // namespace
}  // namespace tessera
