// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A steady drive with what a step may do by default: what waits is bounded by the geometry, and
// drains where the robot stands.
//
// The robot drives along a corridor whose floor and walls are a block thick and full of labels, so
// all blocks cost the same: label_voxels_per_step / 512 = 256 of them spend a step. By d blocks a
// step, d of each of the corridor's n rows of blocks leave the window. If n d <= 256, at most n
// wait: any m steps move the robot's block by no more than m d + 1, so n m d + n blocks come to
// wait in them, and while any wait each step hands out 256 >= n d.
#include <algorithm>

#include "laws/window_twins.hpp"

namespace tessera::oracle {
namespace {

constexpr double kVoxel_m = 0.1;
constexpr int kStepVoxels = 60;  // d = 7.5 blocks: the robot's block moves by 7 and by 8
constexpr int kDriveSteps = 14;
constexpr std::uint32_t kSpent = WindowConfig{}.label_voxels_per_step / kBlockVoxels;

/// Floor of 17 blocks between two walls, as long as a step.
struct Corridor {
  int wall_blocks;  ///< Height of the walls.

  [[nodiscard]] std::uint32_t rows() const {
    return static_cast<std::uint32_t>(17 + 2 * wall_blocks);
  }
  /// A point in each voxel, in the frame of the sensor 0.3 m above the floor.
  [[nodiscard]] Cloud cloud() const {
    Cloud cloud;
    const auto fill_row = [&cloud](int block_y, int block_z, int label) {
      for (int i = 0; i < kStepVoxels * 64; ++i) {
        const int x = i / 64 - kStepVoxels / 2;
        const int y = 8 * block_y + i % 8;
        const int z = 8 * block_z + i / 8 % 8;
        cloud.add((x + 0.5) * kVoxel_m, (y + 0.5) * kVoxel_m, (z + 0.5) * kVoxel_m - 0.3, label);
      }
    };
    for (int y = -8; y <= 8; ++y) fill_row(y, -1, 1);
    for (int z = 0; z < wall_blocks; ++z) {
      fill_row(-8, z, 2);
      fill_row(8, z, 3);
    }
    return cloud;
  }
};

/// All limits of a step as they are by default.
WindowConfig near_window() {
  WindowConfig config;
  config.radius_m = 8.0;
  return config;
}

Twins twins_in(const Corridor& corridor) {
  MapConfig map = uncapped_map(kVoxel_m);
  map.storage_bytes = std::size_t{64} << 20U;
  InferenceConfig inference;
  inference.mode = InferenceMode::kCounting;
  inference.min_range_m = 0.0F;
  inference.max_range_m = 0.0F;
  inference.thinning_m = 0.0;
  inference.free_space.enabled = false;
  const auto points = static_cast<std::uint32_t>(corridor.cloud().size());
  return {map, inference, {.points = points, .tiles = 4096, .ray_blocks = 16}, near_window()};
}

double place_m(int step) { return (step + 0.5) * kStepVoxels * kVoxel_m; }

/// What is in the archive and in the map is what a map without a window has: no voxel is in both,
/// and the sums are whole numbers.
void check_that_nothing_is_lost(Twins& twins) {
  CHECK(twins.archive.merged() == 0);
  CHECK(twins.archive.keys().size() + twins.bounded.map().block_count() ==
        twins.whole.map().block_count());
  gather(twins);
  CHECK(digest_of(twins.bounded.map()) == digest_of(twins.whole.map()));
}

}  // namespace

TEST_CASE("moving window: on a steady drive no more than a row's blocks wait, with the defaults") {
  const Corridor corridor{.wall_blocks = 8};
  const std::uint32_t rows = corridor.rows();
  REQUIRE(rows * kStepVoxels <= kSpent * kBlockEdge);
  REQUIRE(rows * (kStepVoxels / kBlockEdge + 1) > kSpent);  // so that some must wait
  Twins twins = twins_in(corridor);
  const Cloud cloud = corridor.cloud();
  std::uint32_t most_evicted = 0;
  std::uint32_t most_waiting = 0;
  std::uint32_t evicted = 0;
  std::size_t most_blocks = 0;
  for (int i = 0; i < kDriveSteps; ++i) {
    const WindowStep step = twins.drive(cloud, place_m(i), 0.0);
    CHECK(step.evicted <= kSpent);
    CHECK(step.eviction_backlog <= rows);
    CHECK((step.eviction_backlog == 0 || step.evicted == kSpent));
    most_evicted = std::max(most_evicted, step.evicted);
    most_waiting = std::max(most_waiting, step.eviction_backlog);
    most_blocks = std::max(most_blocks, twins.bounded.map().block_count());
    evicted += step.evicted;
  }
  CHECK(most_evicted == kSpent);
  CHECK(most_waiting > 0);
  CHECK(evicted > 8 * kSpent);
  // A row: from where blocks are far behind to where a scan ends ahead, and a step more.
  const double behind_m = near_window().radius_m + near_window().hysteresis_m;
  const double row_m = behind_m + 1.5 * kStepVoxels * kVoxel_m + 4 * kBlockEdge * kVoxel_m;
  CHECK(static_cast<double>(most_blocks) <= rows * (row_m / (kBlockEdge * kVoxel_m) + 1.0));
  WindowStep last;
  for (int i = 0; i < 2; ++i) last = twins.stand(place_m(kDriveSteps - 1));
  CHECK(last.evicted + last.eviction_backlog == 0);
  check_that_nothing_is_lost(twins);
}

TEST_CASE("moving window: a drive that leaves more than a step hands out lets them wait, not go") {
  const Corridor corridor{.wall_blocks = 10};
  const std::uint32_t rows = corridor.rows();
  REQUIRE(rows * kStepVoxels > kSpent * kBlockEdge);
  Twins twins = twins_in(corridor);
  const Cloud cloud = corridor.cloud();
  WindowStep step;
  for (int i = 0; i < kDriveSteps; ++i) step = twins.drive(cloud, place_m(i), 0.0);
  const std::uint32_t waiting = step.eviction_backlog;
  CHECK(waiting > 3 * rows);
  // The last scan's place brings no further block to wait: the robot stands.
  std::uint32_t drained = 0;
  for (std::uint32_t i = 0; i <= waiting / kSpent; ++i)
    drained += twins.stand(place_m(kDriveSteps - 1)).evicted;
  CHECK(drained == waiting);
  const WindowStep idle = twins.stand(place_m(kDriveSteps - 1));
  CHECK(idle.evicted + idle.eviction_backlog == 0);
  check_that_nothing_is_lost(twins);
}

}  // namespace tessera::oracle
