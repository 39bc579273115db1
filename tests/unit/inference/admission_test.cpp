// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What fills the scratch of a scan: wanted units, rays, and admission one by one.
#include <catch2/catch.hpp>
#include <set>

#include "hand_clock.hpp"
#include "held_points.hpp"
#include "support/random.hpp"
#include "support/small_map.hpp"
#include "tessera/inference/internal/point_admission.hpp"
#include "tessera/inference/internal/ray_tracer.hpp"

namespace tessera {
namespace {

const Lattice kLattice(0.1);

/// Returns on a sphere of 2 m.
std::vector<float> sphere_of(std::size_t count, std::uint64_t seed) {
  oracle::Random random(seed);
  std::vector<float> xyz;
  while (xyz.size() < 3 * count) {
    const Point3d p{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (p.norm() > 1.0 || p.norm() < 0.1) continue;
    const Point3f end = (p * (2.0 / p.norm())).cast<float>();
    xyz.insert(xyz.end(), {end.x(), end.y(), end.z()});
  }
  return xyz;
}

/// Blocks with marks, after all or some of the rays were traced.
std::set<std::uint64_t> carved(ScanScratch& scratch) {
  std::set<std::uint64_t> blocks;
  for (const RayBlock& block : scratch.free_space.blocks()) {
    if (block.carves()) blocks.insert(pack_in_grid(block.coord).bits);
  }
  return blocks;
}

}  // namespace

TEST_CASE("want_units: a unit is wanted that has points, or enough neighbours with points") {
  InferenceConfig config = config_without_thinning();
  config.mode = InferenceMode::kMultiEntropy;
  const ScanCapacity capacity{.points = 512, .tiles = 256, .ray_blocks = 64};
  HeldPoints held(capacity.points);
  HeldScratch scratch(capacity);
  const int edge = unit_edge_of(config);
  ScanWork work;
  work.begin(nullptr);
  oracle::Random random(3);
  std::vector<float> xyz;
  for (int i = 0; i < 3 * 400; ++i) xyz.push_back(static_cast<float>(random.uniform(-0.8, 0.8)));
  static_cast<void>(held.take(kLattice, xyz, config, work));
  ScanTiles& tiles = scratch.scratch.tiles;
  tiles.reset(edge);
  REQUIRE(tiles.build(held.points.admitted(), kLattice, held.points.scratch()) == Status::kOk);
  REQUIRE(want_units(tiles, config, {}, 3));

  const auto unit_at = [edge](const VoxelCoord& v) {
    const auto down = [edge](std::int32_t a) {
      return a >= 0 ? a / edge : -((edge - 1 - a) / edge);
    };
    return std::array<int, 3>{down(v.x), down(v.y), down(v.z)};
  };
  std::set<std::array<int, 3>> occupied;
  for (const ScanPoint& point : held.points.admitted()) occupied.insert(unit_at(point.voxel));
  std::set<std::array<int, 3>> expected = occupied;
  for (const std::array<int, 3>& unit : occupied) {
    for (int n = 0; n < 6; ++n) {
      std::array<int, 3> beside = unit;
      beside[static_cast<std::size_t>(n / 2)] += n % 2 == 0 ? -1 : 1;
      int filled = 0;
      for (int m = 0; m < 6; ++m) {
        std::array<int, 3> other = beside;
        other[static_cast<std::size_t>(m / 2)] += m % 2 == 0 ? -1 : 1;
        filled += occupied.count(other) != 0 ? 1 : 0;
      }
      if (filled >= config.entropy.fill_neighbours) expected.insert(beside);
    }
  }
  std::set<std::array<int, 3>> wanted;
  for (const Tile& tile : tiles.tiles()) {
    for (int unit = 0; unit < 64; ++unit) {
      if ((tile.wanted & unit_bit(unit)) != 0)
        wanted.insert({4 * tile.coord.x + (unit & 3), 4 * tile.coord.y + ((unit >> 2) & 3),
                       4 * tile.coord.z + (unit >> 4)});
    }
  }
  CHECK(wanted == expected);
}

TEST_CASE("RayTracer: without a deadline all rays are traced, and late ones in the next scans") {
  InferenceConfig config = config_without_thinning();
  const ScanCapacity capacity{.points = 4096, .tiles = 1024, .ray_blocks = 2048};
  HeldPoints held(capacity.points);
  HeldScratch scratch(capacity);
  ScanWork work;
  work.begin(nullptr);
  static_cast<void>(held.take(kLattice, sphere_of(4000, 5), config, work));
  FreeSpace& free_space = scratch.scratch.free_space;
  const auto begin = [&] { free_space.begin(config.free_space, kLattice, Point3d::Zero()); };
  RayTracer tracer;
  begin();
  REQUIRE(tracer.trace(held.points, free_space, work));
  CHECK(tracer.rays_cut() == 0);
  const std::set<std::uint64_t> all = carved(scratch.scratch);

  std::set<std::uint64_t> seen;
  HandClock hand{.time_us = 0, .step_us = 1};
  Deadline deadline(hand.clock(), 1e6);
  for (int scan = 0; scan < 16; ++scan) {
    tracer.forget_cut();
    begin();
    deadline.begin(hand.time_us + 6);  // a few batches of rays
    work.begin(&deadline);
    work.set_most_per_point(0);
    REQUIRE(tracer.trace(held.points, free_space, work));
    CHECK(tracer.rays_cut() > 0);
    CHECK(tracer.rays_cut() < 4000);
    seen.merge(carved(scratch.scratch));
  }
  CHECK(seen == all);
}

TEST_CASE("PointAdmission: a point is admitted with its ray or not at all, as long as work lasts") {
  InferenceConfig config = config_without_thinning();
  const ScanCapacity capacity{.points = 512, .tiles = 1024, .ray_blocks = 1024};
  HeldPoints held(capacity.points);
  HeldScratch scratch(capacity);
  SmallMap small(config_of_pages(400));
  ScanWork work;
  work.begin(nullptr);
  ScanReport report = held.take(kLattice, sphere_of(400, 7), config, work);
  scratch.scratch.tiles.reset(unit_edge_of(config));
  scratch.scratch.free_space.begin(config.free_space, kLattice, Point3d::Zero());
  work.set_most_per_point(most_evaluations(config, {}));
  work.set_limit(20'000, report);
  PointAdmission admission(small.map, held.points, scratch.scratch, config, {});
  admission.admit(work, true, report);
  const std::size_t admitted = held.points.admitted().size();
  CHECK(admitted > 0);
  CHECK(admitted + report.refused_work == 400);
  CHECK(report.refused_memory() == 0);
  CHECK(report.work_predicted <= 20'000);
  std::uint64_t steps = 0;
  for (const ScanPoint& point : held.points.admitted())
    steps += scratch.scratch.free_space.most_steps(point.p_map);
  CHECK(admission.rays_predicted() == steps);
  CHECK_FALSE(admission.index_refused());
}

TEST_CASE("PointAdmission: what does not fit the map's storage is passed over, by its reason") {
  InferenceConfig config = config_without_thinning();
  const ScanCapacity capacity{.points = 512, .tiles = 1024, .ray_blocks = 1024};
  HeldPoints held(capacity.points);
  HeldScratch scratch(capacity);
  SmallMap small(config_of_pages(12));
  ScanWork work;
  work.begin(nullptr);
  ScanReport report = held.take(kLattice, sphere_of(400, 9), config, work);
  scratch.scratch.tiles.reset(unit_edge_of(config));
  scratch.scratch.free_space.begin(config.free_space, kLattice, Point3d::Zero());
  work.set_limit(0, report);
  PointAdmission admission(small.map, held.points, scratch.scratch, config, {});
  admission.admit(work, false, report);
  CHECK(report.refused_storage > 0);
  CHECK(held.points.admitted().size() > 0);
  CHECK(held.points.admitted().size() + report.refused_memory() == 400);
  // What was admitted fits: filling the scratch for it opens no block that is not open.
  for (const RayBlock& block : scratch.scratch.free_space.blocks()) CHECK(block.reserved);
  const MapUsage usage = small.map.usage();
  CHECK(usage.used_bytes <= usage.capacity_bytes);
}

}  // namespace tessera
