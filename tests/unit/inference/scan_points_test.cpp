// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/scan_points.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <limits>
#include <random>
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

TEST_CASE("ScanPoints: returns are placed alike in all widths, and refused alike") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  // In turns, so that each comes beside others; the last are fewer than a machine has lanes.
  const std::vector<std::array<float, 3>> special{
      {0.0F, 0.0F, 0.0F},     {0.3F, 0.0F, 0.0F},   {kNan, 1.0F, 1.0F},   {1.0F, kInfinite, 1.0F},
      {1.0F, 1.0F, -3.4e38F}, {39.9F, 0.0F, 0.0F},  {40.1F, 0.0F, 0.0F},  {900.0F, 1.0F, 0.0F},
      {0.0F, -1.0F, 0.0F},    {0.9F, -0.9F, 0.05F}, {0.0F, 0.0F, 3.0e7F}, {-40.0F, 0.0F, 0.0F}};
  std::vector<float> xyz;
  std::vector<float> weights;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> coordinate(-45.0F, 45.0F);
  for (std::size_t i = 0; i < 4003; ++i) {
    const std::array<float, 3> any{coordinate(random), coordinate(random), coordinate(random)};
    const std::array<float, 3>& p = i % 7 == 0 ? special[i / 7 % special.size()] : any;
    xyz.insert(xyz.end(), p.begin(), p.end());
    weights.push_back(i % 31 == 0 ? kNan : (i % 17 == 0 ? -1.0F : 0.5F));
  }
  // Farther than floats tell voxels apart, at the grid's end, and turned.
  const std::array<Point3d, 3> places{Point3d(0.213, -0.127, 0.341), Point3d(8.0e5, -3.0e5, 12.5),
                                      Point3d(838859.5, 0.0, 0.0)};
  for (const Point3d& place : places) {
    for (const bool with_body : {false, true}) {
      InferenceConfig config = config_without_thinning();
      config.max_range_m = 40.0F;
      config.free_space.enabled = true;
      if (with_body) {
        config.body.boxes[0] = {.low = {-1.0F, -1.0F, -1.0F}, .high = {1.0F, 1.0F, 1.0F}};
        config.body.count = 1;
      }
      ScanView scan;
      scan.T_map_sensor.row(0) << 0.6, -0.8, 0.0, place.x();
      scan.T_map_sensor.row(1) << 0.8, 0.6, 0.0, place.y();
      scan.T_map_sensor.row(2) << 0.0, 0.0, 1.0, place.z();
      scan.points = xyz.data();
      scan.stride_floats = 3;
      scan.count = weights.size();
      scan.weights = with_body ? weights.data() : nullptr;
      const auto registered = [&](LaneWidth lanes) {
        AlignedMemory memory(ScanPoints::required_bytes(scan.count));
        Arena arena(memory.span());
        ScanPoints points = ScanPoints::make(arena, scan.count, lanes);
        ScanWork work;
        ScanReport report;
        work.begin(nullptr);
        REQUIRE(points.begin(kLattice, place));
        points.register_returns(kLattice, scan, config, 6, work, report);
        CHECK(report.in_range > 500);
        std::vector<double> all{
            static_cast<double>(report.non_finite), static_cast<double>(report.too_near),
            static_cast<double>(report.on_body),    static_cast<double>(report.out_of_grid),
            static_cast<double>(report.in_range),   static_cast<double>(report.beyond_range)};
        for (const std::span<const ScanPoint> part : {points.returns(), points.returns_beyond()}) {
          for (const ScanPoint& p : part) {
            const VoxelCoord& v = p.voxel;
            for (const double value :
                 {static_cast<double>(p.p_map.x()), static_cast<double>(p.p_map.y()),
                  static_cast<double>(p.p_map.z()), static_cast<double>(p.weight),
                  static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z),
                  static_cast<double>(p.component), static_cast<double>(p.label_weights)})
              all.push_back(value);
          }
        }
        return all;
      };
      CHECK(registered(LaneWidth::kWidest) == registered(LaneWidth::kFour));
    }
  }
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
