// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Contributions that are known and not held, and which part of the world matters.
#include "tessera/exchange/internal/far_contributions.hpp"

#include <catch2/catch.hpp>
#include <map>

#include "support/aligned_memory.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/replica/grid_transform.hpp"

namespace tessera {
namespace {

Matrix34d any_frame(oracle::Random& random) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(random.uniform(-1, 1), random.uniform(-1, 1),
                                                  random.uniform(-1, 1), random.uniform(-1, 1))
                                   .normalized();
  Matrix34d T;
  T.leftCols<3>() = q.toRotationMatrix();
  T.col(3) = Point3d(random.uniform(-50, 50), random.uniform(-50, 50), random.uniform(-5, 5));
  return T;
}

TEST_CASE("FarContributions: each is found by its name, until it is removed") {
  constexpr std::uint32_t kPlaces = 200;
  AlignedMemory memory(FarContributions::required_bytes(kPlaces));
  Arena arena(memory.span());
  FarContributions far = *FarContributions::make(arena, kPlaces, 7);
  oracle::Random random(oracle::announce_seed(2131));
  std::map<ContributionId, std::uint32_t> expected;  // and what is noted of it
  for (int step = 0; step < 5000; ++step) {
    const ContributionId id{static_cast<std::uint32_t>(random.below(4)),
                            static_cast<std::uint32_t>(random.below(3)),
                            static_cast<std::uint32_t>(random.below(40))};
    FarContribution* const found = far.find(id);
    REQUIRE((found != nullptr) == (expected.count(id) != 0));
    if (found != nullptr) {
      REQUIRE(found->id() == id);
      REQUIRE(found->segments == expected[id]);
      if (random.below(2) == 0) {
        far.remove(*found);
        expected.erase(id);
      }
    } else {
      FarContribution* const added = far.add(id);
      REQUIRE((added != nullptr) == (expected.size() < kPlaces));
      if (added == nullptr) continue;
      added->segments = static_cast<std::uint32_t>(step);
      expected[id] = static_cast<std::uint32_t>(step);
    }
    REQUIRE(far.size() == expected.size());
  }
  REQUIRE(far.remove_if([](const FarContribution& one) { return one.id().robot == 2; }) != 0);
  for (const auto& [id, noted] : expected) CHECK((far.find(id) == nullptr) == (id.robot == 2));
}

TEST_CASE("FarContributions: what is full takes no more, and of none there is none") {
  AlignedMemory memory(FarContributions::required_bytes(2));
  Arena arena(memory.span());
  FarContributions far = *FarContributions::make(arena, 2, 1);
  REQUIRE(far.add({1, 1, 1}) != nullptr);
  REQUIRE(far.add({1, 1, 2}) != nullptr);
  CHECK_FALSE(far.has_room());
  CHECK(far.add({1, 1, 3}) == nullptr);
  FarContributions none = *FarContributions::make(arena, 0, 1);
  CHECK(none.add({1, 1, 1}) == nullptr);
  CHECK(none.find({1, 1, 1}) == nullptr);
}

TEST_CASE("world_box: wherever resampling takes a voxel, it is within the box of its block") {
  oracle::Random random(oracle::announce_seed(2132));
  constexpr double kResolution_m = 0.1;
  for (int i = 0; i < 300; ++i) {
    const Matrix34d T = any_frame(random);
    const GridTransform frame = *GridTransform::make(T, kResolution_m);
    BlockExtent extent;
    for (int k = 0; k < 2; ++k)
      extent.include(BlockCoord{random.below(20) - 10, random.below(20) - 10, random.below(6) - 3});
    const WorldBox box = world_box(extent, T, kResolution_m);
    const VoxelCoord first{8 * extent.low.x, 8 * extent.low.y, 8 * extent.low.z};
    for (int k = 0; k < 50; ++k) {
      const auto on_axis = [&](int low, int high) {
        return low + random.below(8 * (high - low + 1));
      };
      const VoxelCoord local{on_axis(first.x, first.x + extent.high.x - extent.low.x),
                             on_axis(first.y, first.y + extent.high.y - extent.low.y),
                             on_axis(first.z, first.z + extent.high.z - extent.low.z)};
      const auto is_within = [&](VoxelCoord target) {
        const std::array<int, 3> of{target.x, target.y, target.z};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          REQUIRE(kResolution_m * of[axis] >= box.low[axis] - 1e-9);
          REQUIRE(kResolution_m * (of[axis] + 1) <= box.high[axis] + 1e-9);
        }
      };
      frame.for_targets(local, is_within);
      const std::array<int, 3> levels{random.below(6), random.below(6), random.below(6)};
      if (!frame.shift_only()) frame.for_box_corners(local, Centroid::of_levels(levels), is_within);
    }
  }
}

TEST_CASE("PlacesOfInterest: the distance is that to the nearest ball, and below 0 within one") {
  PlacesOfInterest places;
  const WorldBox box{{10, 0, 0}, {20, 10, 5}};
  CHECK(places.distance_m(box) == 0.0);
  const std::array one{Point3d(0, 5, 0)};
  places.set(one, 4.0);
  CHECK(places.any());
  CHECK(places.distance_m(box) == Approx(6.0));
  const std::array two{Point3d(0, 5, 0), Point3d(23, 14, 5)};
  places.set(two, 4.0);
  CHECK(places.distance_m(box) == Approx(1.0));
  const std::array within{Point3d(15, 5, 2)};
  places.set(within, 4.0);
  CHECK(places.distance_m(box) == Approx(-4.0));
  places.set({}, 4.0);
  CHECK(places.distance_m(box) == 0.0);
}

}  // namespace
}  // namespace tessera
