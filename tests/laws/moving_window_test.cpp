// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whatever the robot drives, window and archive together hold the same evidence as a map without a
// window, and no step does more than it may.
#include <catch2/catch.hpp>

#include "laws/window_twins.hpp"

namespace tessera::oracle {
namespace {

/// Steps of all work so small that most of a jump has to wait.
WindowConfig narrow_window() {
  return {.radius_m = 4.0,
          .hysteresis_m = 0.5,
          .entries_per_step = 16384,
          .evictions_per_step = 12,
          .pressed_evictions_per_step = 30,
          .regions_per_step = 24,
          .reloads_per_step = 9};
}

Cloud surroundings(Random& random) {
  Cloud cloud;
  for (int i = 0; i < 250; ++i) {
    const double u = random.uniform(-3, 3);
    const double v = random.uniform(-0.6, 0.6);
    const int label = 1 + random.below(5);
    if (i % 2 == 0)
      cloud.add(u, random.uniform(-3, 3), -0.6, label);
    else
      cloud.add(u, 1.7 * v, v, label);
  }
  return cloud;
}

/// There, back again, jumps, and standing still.
std::vector<Point3d> random_drive(Random& random) {
  std::vector<Point3d> places;
  Point3d p = Point3d::Zero();
  for (int leg = 0; leg < 6; ++leg) {
    const Point3d heading(random.uniform(-1.5, 1.5), random.uniform(-0.5, 0.5), 0.0);
    const int scans = 3 + random.below(5);
    for (int i = 0; i < scans; ++i) places.push_back(p += heading);
    if (leg % 2 == 1) p = Point3d(random.uniform(-20, 20), random.uniform(-20, 20), 0.0);
    if (leg == 2) p = Point3d::Zero();
  }
  places.insert(places.end(), 3, p);
  return places;
}

}  // namespace

TEST_CASE("moving window: with sums that are exact, window and archive hold the same map") {
  for (const std::uint64_t seed : {7401U, 7402U, 7403U, 7404U}) {
    // Whole numbers without a cap: the order in which they are added cannot matter.
    Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, narrow_window());
    Random random(announce_seed(seed));
    std::uint32_t evicted = 0;
    std::uint32_t reloaded = 0;
    std::uint32_t merged = 0;
    std::uint32_t backlog = 0;
    for (const Point3d& p : random_drive(random)) {
      const WindowStep step = twins.drive(surroundings(random), p.x(), p.y());
      evicted += step.evicted;
      reloaded += step.reloaded;
      merged += step.merged;
      backlog += step.eviction_backlog + step.reload_backlog;
    }
    CHECK(evicted > 100);
    CHECK(reloaded > 20);
    CHECK(merged + twins.archive.merged() > 0);
    CHECK(backlog > 0);
    CHECK(twins.bounded.map().block_count() < twins.whole.map().block_count());
    gather(twins);
    CHECK(digest_of(twins.bounded.map()) == digest_of(twins.whole.map()));
    CHECK(empty_blocks(twins.bounded.map()) == 0);
    CHECK(twins.bounded.map().usage().label_voxels == twins.whole.map().usage().label_voxels);
  }
}

TEST_CASE(
    "moving window: where blocks come back before they are seen, any mode gives the same map") {
  WindowConfig roomy = narrow_window();
  roomy.entries_per_step = 1U << 20U;
  roomy.evictions_per_step = roomy.pressed_evictions_per_step = 1U << 20U;
  roomy.regions_per_step = roomy.reloads_per_step = 1U << 20U;
  for (const Setting setting :
       {Setting{InferenceMode::kMultiEntropy, TuplePolicy::kDense, 10.0F},
        Setting{InferenceMode::kMultiEntropy, TuplePolicy::kCompact, 10.0F},
        Setting{InferenceMode::kCounting, TuplePolicy::kCompact, 0.0F},
        Setting{InferenceMode::kMultiEntropy, TuplePolicy::kCompact, 10.0F, Carving::kImage}}) {
    Twins twins(setting, roomy);
    Random random(announce_seed(7410));
    std::uint32_t reloaded = 0;
    for (const Point3d& p : random_drive(random)) {
      const WindowStep step = twins.drive(surroundings(random), p.x(), p.y());
      CHECK(step.merged == 0);
      CHECK(step.eviction_backlog + step.reload_backlog == 0);
      reloaded += step.reloaded;
    }
    CHECK(reloaded > 20);
    CHECK(twins.archive.merged() == 0);
    gather(twins);
    CHECK(digest_of(twins.bounded.map()) == digest_of(twins.whole.map()));
  }
}

TEST_CASE("moving window: compact counts that meet again lose no evidence") {
  Twins twins({InferenceMode::kCounting, TuplePolicy::kCompact, 0.0F}, narrow_window());
  Random random(announce_seed(7420));
  std::uint32_t merged = 0;
  for (const Point3d& p : random_drive(random))
    merged += twins.drive(surroundings(random), p.x(), p.y()).merged;
  CHECK(merged + twins.archive.merged() > 0);
  gather(twins);
  // Which classes have slots may differ: the sums must not.
  const auto bounded = observed_voxels(twins.bounded.map());
  const auto whole = observed_voxels(twins.whole.map());
  REQUIRE(bounded.size() == whole.size());
  for (const auto& [voxel, evidence] : whole)
    REQUIRE(bounded.at(voxel).total() == Approx(evidence.total()).margin(1e-9));
}

TEST_CASE("moving window: under a cap, what meets again is held to it and never too much") {
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 4.0F}, narrow_window());
  Random random(announce_seed(7430));
  for (const Point3d& p : random_drive(random)) twins.drive(surroundings(random), p.x(), p.y());
  gather(twins);
  CHECK(observed_voxels(twins.bounded.map()).size() >=
        observed_voxels(twins.whole.map()).size() * 99 / 100);
  for (const auto& [voxel, evidence] : observed_voxels(twins.bounded.map()))
    REQUIRE(evidence.total() <= 4.0 * 1.0001);
}

TEST_CASE("moving window: blocks that the archive refuses stay, and are counted") {
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, narrow_window());
  Random random(announce_seed(7440));
  std::uint32_t refused = 0;
  for (int scan = 0; const Point3d& p : random_drive(random)) {
    twins.archive.full = ++scan % 3 != 0;
    const WindowStep step = twins.drive(surroundings(random), p.x(), p.y());
    CHECK((!twins.archive.full || step.evicted == 0));
    refused += step.evictions_refused;
  }
  CHECK(refused > 50);
  gather(twins);
  CHECK(digest_of(twins.bounded.map()) == digest_of(twins.whole.map()));
}

TEST_CASE("moving window: a jump is worked off step by step, and nothing waits for ever") {
  WindowConfig config = narrow_window();
  config.entries_per_step = 1U << 20U;  // so that backlogs are whole
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, config);
  Random random(announce_seed(7450));
  for (int i = 0; i < 3; ++i) twins.drive(surroundings(random), 0.2 * i, 0.0);
  REQUIRE(twins.archive.keys().empty());
  const auto before = static_cast<std::uint32_t>(twins.bounded.map().block_count());
  WindowStep step = twins.stand(90.0);
  CHECK(step.evicted == narrow_window().evictions_per_step);
  CHECK(step.eviction_backlog + step.evicted == before);
  std::uint32_t steps = 1;
  while (step.eviction_backlog > 0) {
    const std::uint32_t left = step.eviction_backlog;
    step = twins.stand(90.0);
    REQUIRE(step.eviction_backlog + step.evicted == left);
    REQUIRE(step.evicted > 0);
    ++steps;
  }
  CHECK(steps == (before + 11) / 12);
  CHECK(twins.bounded.map().block_count() == 0);
  const double archived = total_evidence(twins.whole.map());
  std::uint32_t reloaded = 0;
  for (int i = 0; i < 200 && !twins.archive.keys().empty(); ++i)
    reloaded += twins.stand(0.2).reloaded;
  CHECK(reloaded == before);
  CHECK(total_evidence(twins.bounded.map()) == Approx(archived));
}

TEST_CASE("moving window: a step ends with the block that spends its label voxels, both ways") {
  WindowConfig config = narrow_window();
  config.entries_per_step = config.regions_per_step = config.reloads_per_step = 1U << 20U;
  config.evictions_per_step = config.pressed_evictions_per_step = 1U << 20U;
  config.label_voxels_per_step = 20;
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, config);
  Random random(announce_seed(7460));
  for (int i = 0; i < 3; ++i) twins.drive(surroundings(random), 0.2 * i, 0.0);
  const auto voxels = [&twins] { return twins.bounded.map().usage().label_voxels; };
  const std::uint64_t all = voxels();
  int steps = 0;
  for (WindowStep step = twins.stand(90.0); step.eviction_backlog > 0; ++steps) {
    const std::uint64_t before = voxels();
    step = twins.stand(90.0);
    REQUIRE(before - voxels() < 20 + kBlockVoxels);
    REQUIRE((before - voxels() >= 20 || voxels() == 0));
  }
  CHECK(steps > 10);
  for (steps = 0; !twins.archive.keys().empty() && steps < 10000; ++steps) {
    const std::uint64_t before = voxels();
    twins.stand(0.2);
    REQUIRE(voxels() - before < 20 + kBlockVoxels);
  }
  CHECK(steps > 10);
  CHECK(voxels() == all);
}

TEST_CASE("moving window: a map without room for what comes back leaves it archived") {
  MapConfig small = uncapped_map(0.1);
  small.storage_bytes = 4 * SlabPool::kPageBytes;
  Twins twins({InferenceMode::kCounting, TuplePolicy::kDense, 0.0F}, narrow_window());
  Random random(announce_seed(7460));
  for (int i = 0; i < 3; ++i) twins.drive(surroundings(random), 30.0 * i, 0.0);
  while (twins.stand(500.0).eviction_backlog > 0) {
  }
  Mapper tiny(small, {}, 5, {.points = 16, .tiles = 16, .ray_blocks = 16});
  const std::size_t archived = twins.archive.keys().size();
  std::uint32_t reloaded = 0;
  bool no_room = false;
  for (int i = 0; i < 60; ++i) {
    const WindowStep step =
        twins.window.step(tiny.map(), Point3d(0, 0, 0.3), twins.archive.interface());
    reloaded += step.reloaded;
    no_room = no_room || (step.no_room && step.reload_backlog > 0);
  }
  CHECK(no_room);
  CHECK(twins.archive.keys().size() + reloaded == archived);
  CHECK(tiny.map().block_count() == reloaded);
}

}  // namespace tessera::oracle
