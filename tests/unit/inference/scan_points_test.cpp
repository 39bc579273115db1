// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/scan_points.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "hand_clock.hpp"
#include "held_points.hpp"

namespace tessera {
namespace {

/// Returns along x at 1, 2, ... metres.
std::vector<float> line_of(std::size_t count) {
  std::vector<float> xyz;
  for (std::size_t i = 0; i < count; ++i)
    xyz.insert(xyz.end(), {static_cast<float>(i + 1), 0.05F, 0.05F});
  return xyz;
}

const Lattice kLattice(0.1);

}  // namespace

TEST_CASE("ScanPoints: a scan is seen from a place in the grid, or it has no points") {
  HeldPoints held(4);
  CHECK(held.points.begin(kLattice, {1.0, -2.0, 0.05}));
  CHECK(held.points.origin_voxel() == VoxelCoord{10, -20, 0});
  CHECK_FALSE(held.points.begin(kLattice, {1e300, 0.0, 0.0}));
  CHECK_FALSE(held.points.begin(kLattice, {0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}));
  CHECK(held.points.admitted().empty());
}

TEST_CASE("ScanPoints: more returns than fit are sampled evenly, from the first on") {
  HeldPoints held(4);
  ScanWork work;
  const std::vector<float> xyz = line_of(10);
  work.begin(nullptr);
  const InferenceConfig config = config_without_thinning();
  const ScanReport report = held.take(kLattice, xyz, config, work);
  CHECK(report.over_capacity == 6);
  REQUIRE(held.points.admitted().size() == 4);
  const std::array<float, 4> expected{1.0F, 3.0F, 6.0F, 8.0F};
  for (std::size_t i = 0; i < 4; ++i) CHECK(held.points.admitted()[i].p_map.x() == expected[i]);
  CHECK(report.in_range == 4);
  CHECK(report.unlabelled == 0);
}

TEST_CASE("ScanPoints: a return beyond the range limit is the end of a ray at that limit") {
  HeldPoints held(8);
  ScanWork work;
  InferenceConfig config = config_without_thinning();
  config.max_range_m = 3.0F;
  const std::vector<float> xyz{1.0F, 0.0F, 0.0F, 0.0F, 30.0F, 40.0F, 0.0F, 0.0F, -2.0F};
  work.begin(nullptr);
  const ScanReport report = held.take(kLattice, xyz, config, work);
  CHECK(report.beyond_range == 1);
  REQUIRE(held.points.rays().size() == 1);
  CHECK(held.points.rays()[0].p_map.y() == Approx(1.8));
  CHECK(held.points.rays()[0].p_map.z() == Approx(2.4));
  CHECK(&held.points.end_of_ray(2) == held.points.rays().data());
  CHECK(held.points.admitted().size() == 2);
}

TEST_CASE("ScanPoints: where the time is up all returns are left out, and counted") {
  HandClock hand{.time_us = 0, .step_us = 60};
  Deadline deadline(hand.clock());
  HeldPoints held(3 * ScanPoints::kReturnBatch);
  ScanWork work;
  const std::vector<float> xyz(9 * ScanPoints::kReturnBatch, 1.0F);
  deadline.begin(150);  // over in the third batch
  work.begin(&deadline);
  const InferenceConfig config = config_without_thinning();
  const ScanReport report = held.take(kLattice, xyz, config, work);
  CHECK(work.cut());
  CHECK(report.returns_cut == 3 * ScanPoints::kReturnBatch);
  CHECK(report.in_range == 0);
  CHECK(held.points.admitted().empty());
}

TEST_CASE("ScanPoints: what is refused is taken out, and the rest keeps its order") {
  HeldPoints held(16);
  ScanWork work;
  InferenceConfig config = config_without_thinning();
  config.max_range_m = 6.5F;
  const std::vector<float> xyz = line_of(10);  // six points, four rays
  work.begin(nullptr);
  static_cast<void>(held.take(kLattice, xyz, config, work));
  REQUIRE(held.points.admitted().size() == 6);
  REQUIRE(held.points.rays().size() == 4);
  std::size_t seen = 0;
  for (const KeyedIndex& item : held.points.in_order(2, true, false)) {
    seen |= std::size_t{1} << item.index;
    if (item.index % 2 == 0) held.points.refuse(item.index);
  }
  CHECK(seen == 0x3ff);
  held.points.drop_refused();
  REQUIRE(held.points.admitted().size() == 3);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(held.points.admitted()[i].p_map.x() == static_cast<float>(2 * i + 2));
  CHECK(held.points.rays().size() == 2);
  held.points.drop_all();
  CHECK(held.points.admitted().size() + held.points.rays().size() == 0);
}

}  // namespace tessera
