// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where a map has no room for what lies within its window, the farthest blocks within it are
// archived: no evidence is lost by it, and each scan finds the room that it may take.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "laws/window_twins.hpp"

namespace tessera::oracle {
namespace {

/// Octets for which there is room in an empty map of the tests.
std::uint32_t octets_of_storage() {
  const Mapper empty(uncapped_map(0.1), {}, 5, {.points = 16, .tiles = 16, .ray_blocks = 16});
  std::uint32_t octets = 0;
  for (std::uint32_t more = 1U << 20U; more != 0; more /= 2)
    octets += empty.map().fits({0, 0, 0, octets + more}) ? more : 0;
  return octets;
}

/// A window that nothing is too far for, of a map that keeps room for all but some hundred blocks.
WindowConfig wide_window() {
  constexpr std::uint32_t kAll = 1U << 20U;
  return {.radius_m = 100.0,
          .entries_per_step = kAll,
          .evictions_per_step = kAll,
          .pressed_evictions_per_step = kAll,
          .regions_per_step = kAll,
          .reloads_per_step = kAll,
          .label_voxels_per_step = kAll,
          .reserve = {0, 0, 0, octets_of_storage() / 100 * 96},
          .evicts_near = true};
}

Cloud floor_around(Random& random) {
  Cloud cloud;
  for (int i = 0; i < 400; ++i)
    cloud.add(random.uniform(-3, 3), random.uniform(-3, 3), -0.6, 1 + random.below(5));
  return cloud;
}

double farthest_block_m(const LocalMap& map, double x) {
  double most = 0.0;
  for (const auto& [voxel, evidence] : observed_voxels(map))
    most = std::max(most, std::abs(0.1 * static_cast<double>(voxel[0]) - x));
  return most;
}

TEST_CASE("near blocks: with exact sums, the map is that of ample memory, there and back again") {
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, wide_window());
  Random random(announce_seed(7470));
  std::uint32_t near = 0;
  std::uint32_t least_reach = UINT32_MAX;
  for (int i = 0; i < 60; ++i) {
    const double x = i < 30 ? 1.0 * i : 1.0 * (60 - i);
    const WindowStep step = twins.drive(floor_around(random), x, 0.0);
    near += step.near_evicted;
    least_reach = std::min(least_reach, step.reach_blocks);
    CHECK(step.near_evicted == step.evicted);
    CHECK(step.eviction_backlog == 0);
  }
  CHECK(near > 500);
  CHECK(least_reach < 30);
  CHECK(twins.bounded.map().block_count() < twins.whole.map().block_count() * 2 / 3);
  gather(twins);
  CHECK(digest_of(twins.bounded.map()) == digest_of(twins.whole.map()));
}

TEST_CASE("near blocks: after a step there is room for the reserve, and what is left is nearest") {
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, wide_window());
  Random random(announce_seed(7480));
  bool pressed = false;
  for (int i = 0; i < 40; ++i) {
    const double x = 0.8 * i;
    twins.drive(floor_around(random), x, 0.0);
    const WindowStep step = twins.stand(x);
    REQUIRE(twins.bounded.map().fits(wide_window().reserve));
    pressed = pressed || step.near_evicted > 0;
    // A block's diagonal each for the robot's and the other's.
    const double reach_m = 0.8 * step.reach_blocks + 2 * 1.4;
    if (step.near_evicted > 0) REQUIRE(farthest_block_m(twins.bounded.map(), x) < reach_m);
  }
  CHECK(pressed);
}

TEST_CASE("near blocks: a scan that fills most of the map finds room after the first of its kind") {
  const int share = GENERATE(10, 30, 45, 60);
  MapConfig map = uncapped_map(0.1);
  map.storage_bytes = 64 * SlabPool::kPageBytes;
  InferenceConfig inference = Twins::inference_of({InferenceMode::kCounting, {}, 0.0F});
  inference.free_space.enabled = false;
  WindowConfig config = wide_window();
  config.reserve = {};
  Mapper mapper(map, inference, 5, test_capacity());
  MemoryArchive archive(mapper.map());
  MovingWindow window = *MovingWindow::make(config, map.resolution_m);
  Random random(announce_seed(7475));
  // Octets side by side, so many that they take this share of the map.
  std::uint32_t octets = 0;
  while (mapper.map().fits({octets / 8, octets / 8, 0, octets})) octets += 8;
  const int side = static_cast<int>(std::sqrt(octets / 100.0 * share));
  Cloud cloud;
  for (int a = 0; a < side; ++a) {
    for (int b = 0; b < side; ++b)
      cloud.add(0.2 * (a - side / 2) + 0.05, 0.2 * (b - side / 2) + 0.05, -0.55,
                1 + random.below(5));
  }
  for (int i = 0; i < 5; ++i) {
    Matrix34d T_map_sensor = Matrix34d::Identity();
    T_map_sensor.col(3) = Point3d(0.0, 30.0 * i, 0.3);
    const WindowStep step = window.step(mapper.map(), T_map_sensor.col(3), archive.interface());
    REQUIRE(step.position == Status::kOk);
    const auto left_out = mapper.integrate(cloud, T_map_sensor).left_out();
    INFO("scan " << i << " of " << cloud.size() << " points");
    if (i != 1) CHECK(left_out == 0);
  }
}

TEST_CASE("near blocks: an archive that takes nothing keeps none of them waiting for ever") {
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, wide_window());
  Random random(announce_seed(7500));
  twins.archive.full = true;
  std::uint32_t refused = 0;
  for (int i = 0; i < 30; ++i) {
    const WindowStep step = twins.drive(floor_around(random), 1.0 * i, 0.0);
    CHECK(step.evicted == 0);
    refused += step.evictions_refused;
  }
  CHECK(refused > 500);
  twins.archive.full = false;
  CHECK(twins.stand(30.0).near_evicted > 100);
  CHECK(twins.bounded.map().fits(wide_window().reserve));
  gather(twins);
  CHECK(digest_of(twins.bounded.map()) == digest_of(twins.whole.map()));
}

TEST_CASE("near blocks: a step of bounded work goes on where the last one ended") {
  WindowConfig config = wide_window();
  config.evictions_per_step = 5;
  config.pressed_evictions_per_step = 20;
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, config);
  Random random(announce_seed(7510));
  for (int i = 0; i < 30; ++i) {
    const WindowStep step = twins.drive(floor_around(random), 1.0 * i, 0.0);
    CHECK(step.near_evicted <= 20);
  }
  int steps = 0;
  for (; !twins.bounded.map().fits(config.reserve) && steps < 1000; ++steps) {
    const WindowStep step = twins.stand(30.0);
    REQUIRE(step.near_evicted > 0);
    REQUIRE(step.near_evicted <= 20);
  }
  CHECK(steps < 1000);
  gather(twins);
  CHECK(digest_of(twins.bounded.map()) == digest_of(twins.whole.map()));
}

}  // namespace
}  // namespace tessera::oracle
