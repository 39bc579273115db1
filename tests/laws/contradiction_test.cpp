// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Evidence that is contradicted: what a scan sees through goes, what a sensor misses stays.
#include <catch2/catch.hpp>
#include <cmath>

#include "laws/image_scenes.hpp"

namespace tessera::oracle {
namespace {

/// Of numbered_classes() none moves, so the tests say which.
constexpr int kWall = 1;
constexpr int kCar = 2;

ClassTable wall_and_car() {
  ClassTable classes;
  static_cast<void>(classes.add("wall", Color{}, false));
  static_cast<void>(classes.add("thing", Color{}, true));
  return classes;
}

/// What a robot makes of its scans.
class Street {
 public:
  explicit Street(double thinning_m = 0.0)
      : memory_(required_bytes(map_config()) +
                Integrator::required_bytes(kCapacity, config(thinning_m))) {
    Arena arena(memory_.span());
    map_ = std::move(*LocalMap::make(arena, map_config(), wall_and_car()));
    integrator_ = std::move(*Integrator::make(arena, config(thinning_m), kCapacity));
  }
  ScanReport look(const Cloud& cloud, const Vector& at = {0.05, 0.05, 0.05}) {
    return integrator_.integrate(map_, cloud.view(pose_at(at)));
  }
  [[nodiscard]] VoxelState state(const Vector& p) const {
    return map_.query(Point3d(p[0], p[1], p[2]).cast<float>()).state;
  }
  [[nodiscard]] LocalMap& map() { return map_; }

 private:
  static constexpr ScanCapacity kCapacity{.points = 90000, .tiles = 8192, .ray_blocks = 60000};
  static InferenceConfig config(double thinning_m) {
    InferenceConfig config = by_image(25.0);
    config.thinning_m = thinning_m;
    return config;
  }
  static MapConfig map_config() {
    MapConfig map = uncapped_map(0.1);
    map.max_evidence = 100.0F;
    return map;
  }
  AlignedMemory memory_;
  LocalMap map_;
  Integrator integrator_;
};

/// A wall across the street 12 m ahead, and if label is not 0 a box before it, 8 m ahead, 1 m high
/// and from low_m to high_m to the left.
Cloud wall_with(int label, double low_m = -0.5, double high_m = 0.5) {
  Cloud cloud;
  for (double e = -5.0; e <= 5.0; e += 0.4) {
    for (double a = -8.0; a <= 8.0; a += 0.1) {
      const double y = std::tan(a * kRadians);
      const double z = std::tan(e * kRadians) / std::cos(a * kRadians);
      const bool is_box =
          label != 0 && 8.0 * y > low_m && 8.0 * y < high_m && std::fabs(8.0 * z) < 0.5;
      const double x = is_box ? 8.0 : 12.0;
      cloud.add(x, x * y, x * z, is_box ? label : kWall);
    }
  }
  return cloud;
}

const Vector kInBox{8.05, 0.05, 0.05};

}  // namespace

TEST_CASE("contradiction: what stands goes by the second scan that sees through it, not by one") {
  const int hits = GENERATE(1, 3, 40);
  CAPTURE(hits);
  Street street;
  for (int i = 0; i < hits; ++i) street.look(wall_with(kWall));
  REQUIRE(street.state(kInBox) == VoxelState::kOccupied);
  const ScanReport once = street.look(wall_with(0));
  CHECK(street.state(kInBox) == VoxelState::kOccupied);
  CHECK(once.voxels_doubted > 50);
  CHECK(once.voxels_cleared == 0);
  CHECK(street.map().query(Point3f(8.05F, 0.05F, 0.05F)).label == kWall);
  const ScanReport twice = street.look(wall_with(0));
  CHECK(street.state(kInBox) == VoxelState::kFree);
  CHECK(twice.voxels_doubted == 0);
  CHECK(twice.voxels_cleared == once.voxels_doubted);
  // Nothing of the box is left, and the wall behind it is whole.
  for (double y = -0.35; y < 0.4; y += 0.1) {
    for (double z = -0.35; z < 0.4; z += 0.1)
      CHECK(street.state({8.05, y, z}) == VoxelState::kFree);
    CHECK(street.state({12.05, y + 0.05, 0.05}) == VoxelState::kOccupied);
  }
}

TEST_CASE("contradiction: what may move goes by the first scan that sees through it") {
  Street street;
  for (int i = 0; i < 40; ++i) street.look(wall_with(kCar));
  REQUIRE(street.state(kInBox) == VoxelState::kOccupied);
  const ScanReport once = street.look(wall_with(0));
  CHECK(street.state(kInBox) == VoxelState::kFree);
  CHECK(once.voxels_cleared > 50);
  CHECK(once.voxels_doubted == 0);
  // It comes back at once, too.
  street.look(wall_with(kCar));
  CHECK(street.state(kInBox) == VoxelState::kOccupied);
}

TEST_CASE("contradiction: a block of which nothing is left is closed by the same scan") {
  Street street;
  Cloud thing;
  thing.add(8.0, 0.0, 0.0, kCar);
  street.look(thing);
  REQUIRE(street.state(kInBox) == VoxelState::kOccupied);
  // A return close beside the ray that sees through it, so that nothing there is carved.
  Cloud wall;
  wall.add(12.0, 0.0, 0.0, kWall);
  wall.add(5.0, 0.0, 5.0 * std::tan(0.5 * kRadians), kWall);
  const ScanReport report = street.look(wall);
  CHECK(report.voxels_cleared == 1);
  CHECK(street.map().find(BlockCoord{10, 0, 0}) == nullptr);
  CHECK(empty_blocks(street.map()) == 0);
}

TEST_CASE("contradiction: what moves and was met often is not cleared by rays close beside it") {
  // Above the horizon a wall behind the box is met, below it something before the box: of the
  // pixels around a voxel at the horizon some are farther, not all.
  Cloud beside;
  for (double e = -5.0; e <= 5.0; e += 0.4) {
    for (double a = -8.0; a <= 8.0; a += 0.1) {
      const double y = std::tan(a * kRadians);
      const double x = e > 0.0 ? 12.0 : 7.0;
      beside.add(x, x * y, x * std::tan(e * kRadians), kWall);
    }
  }
  const int label = GENERATE(kWall, kCar);
  const bool often = GENERATE(false, true);
  CAPTURE(label, often);
  Street street(0.1);  // A scan adds about one point to a voxel.
  for (int i = 0; i < (often ? 40 : 2); ++i) street.look(wall_with(label));
  REQUIRE(street.state(kInBox) == VoxelState::kOccupied);
  for (int i = 0; i < 5; ++i) street.look(beside);
  const bool goes = label == kCar && !often;
  CHECK(street.state(kInBox) == (goes ? VoxelState::kFree : VoxelState::kOccupied));
}

TEST_CASE("contradiction: a hit between two scans that see through begins it anew") {
  Street street;
  for (int i = 0; i < 3; ++i) street.look(wall_with(kWall));
  for (int i = 0; i < 30; ++i) {
    street.look(wall_with(0));
    REQUIRE(street.state(kInBox) == VoxelState::kOccupied);
    street.look(wall_with(kWall));
  }
  CHECK(street.state(kInBox) == VoxelState::kOccupied);
}

TEST_CASE("contradiction: what is beside a thing that may move goes with it") {
  // The left part of it was labelled as a wall.
  Street mislabelled;
  const auto mixed = [&](int label_of_left) {
    Cloud cloud;
    for (double e = -5.0; e <= 5.0; e += 0.4) {
      for (double a = -8.0; a <= 8.0; a += 0.1) {
        const double y = std::tan(a * kRadians);
        const bool is_box = std::fabs(8.0 * y - 0.4) < 0.3;
        const double x = is_box ? 8.0 : 12.0;
        cloud.add(x, x * y, x * std::tan(e * kRadians),
                  !is_box         ? kWall
                  : 8.0 * y < 0.3 ? label_of_left
                                  : kCar);
      }
    }
    return cloud;
  };
  for (int i = 0; i < 5; ++i) mislabelled.look(mixed(kWall));
  REQUIRE(mislabelled.state({8.05, 0.25, 0.05}) == VoxelState::kOccupied);
  mislabelled.look(wall_with(0));
  CHECK(mislabelled.state({8.05, 0.25, 0.05}) == VoxelState::kFree);
  CHECK(mislabelled.state({8.05, 0.55, 0.05}) == VoxelState::kFree);
  Street alone;
  for (int i = 0; i < 5; ++i) alone.look(wall_with(kWall, 0.1, 0.7));
  alone.look(wall_with(0));
  CHECK(alone.state({8.05, 0.25, 0.05}) == VoxelState::kOccupied);
}

TEST_CASE(
    "contradiction: what lies hidden, or out of sight, or in the last few centimetres stays") {
  Street street;
  for (int i = 0; i < 3; ++i) street.look(wall_with(kCar));
  // A wall before it, one just behind its front, and one that leaves it out of sight.
  const auto at = [](double x, double from_deg, double to_deg) {
    Cloud cloud;
    for (double e = -5.0; e <= 5.0; e += 0.4) {
      for (double a = from_deg; a <= to_deg; a += 0.1) {
        const double y = std::tan(a * kRadians);
        cloud.add(x, x * y, x * std::tan(e * kRadians), kWall);
      }
    }
    return cloud;
  };
  for (int i = 0; i < 20; ++i) {
    CHECK(street.look(at(4.0, -8.0, 8.0)).voxels_cleared == 0);
    CHECK(street.look(at(8.08, -8.0, 8.0)).voxels_cleared == 0);
    CHECK(street.look(at(12.0, 20.0, 30.0)).voxels_cleared == 0);
    CHECK(street.state(kInBox) == VoxelState::kOccupied);
  }
}

TEST_CASE("contradiction: points on a fence with gaps of half its width, and on thin poles, stay") {
  // Bars 3 cm wide every 6 cm at 6 m; poles 5 cm wide at 15 m, which rows 0.4 degrees apart and
  // columns 0.16 degrees apart, each scan somewhere else, meet now and then.
  Random random(announce_seed(222));
  Street street;
  std::map<Voxel, int> hits;
  const auto look = [&](bool count) {
    Cloud cloud;
    const double shift_a = random.uniform(0.0, 0.16);
    const double shift_e = random.uniform(-0.02, 0.02);
    for (double e = -5.0; e <= 5.0; e += 0.4) {
      for (double a = -20.0; a <= 20.0; a += 0.16) {
        const double azimuth_rad = (a + shift_a + random.uniform(-0.01, 0.01)) * kRadians;
        const double y = std::tan(azimuth_rad);
        const double z = std::tan((e + shift_e) * kRadians);
        const double on_fence_m = 6.0 * y - 0.06 * std::floor(6.0 * y / 0.06);
        const bool fence = y > 0.02 && y < 0.3 && std::fabs(6.0 * z) < 0.4 && on_fence_m < 0.03;
        const double on_row_m = 15.0 * y - 0.8 * std::floor(15.0 * y / 0.8);
        const bool pole = y < -0.02 && on_row_m < 0.05;
        const double x = fence ? 6.0 : pole ? 15.0 : 22.0;
        const double noisy = x + random.uniform(-0.02, 0.02);
        cloud.add(noisy, noisy * y, noisy * z, kWall);
        if ((fence || pole) && count)
          ++hits[cell_of({noisy + 0.05, noisy * y + 0.05, noisy * z + 0.05}, 0.1)];
      }
    }
    street.look(cloud);
  };
  for (int i = 0; i < 100; ++i) look(true);
  int fences = 0;
  int poles = 0;
  int kept_fences = 0;
  int kept_poles = 0;
  for (const auto& [voxel, count] : hits) {
    const bool kept = street.map()
                          .query(VoxelCoord{static_cast<std::int32_t>(voxel[0]),
                                            static_cast<std::int32_t>(voxel[1]),
                                            static_cast<std::int32_t>(voxel[2])})
                          .state == VoxelState::kOccupied;
    const bool is_pole = voxel[0] > 100;
    (is_pole ? poles : fences) += count;
    (is_pole ? kept_poles : kept_fences) += kept ? count : 0;
  }
  CAPTURE(fences, kept_fences, poles, kept_poles);
  REQUIRE(fences > 10000);
  REQUIRE(poles > 5000);
  CHECK(kept_fences >= 0.99 * fences);
  CHECK(kept_poles >= 0.99 * poles);
}

}  // namespace tessera::oracle
