// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points and voxels: a point belongs to the voxel that contains it, negatives floor, what is
// outside the grid is refused.
#include "tessera/grid/lattice.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "support/random.hpp"

namespace tessera {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

VoxelCoord voxel(const Lattice& lattice, float x, float y, float z) {
  const Result<VoxelCoord> result = lattice.voxel_of({x, y, z});
  REQUIRE(result.ok());
  return *result;
}

static_assert(floor_to_int(0.0) == 0 && floor_to_int(0.999) == 0 && floor_to_int(1.0) == 1);
static_assert(floor_to_int(-0.001) == -1 && floor_to_int(-1.0) == -1 && floor_to_int(-1.001) == -2);
static_assert(floor_to_int64(-0x1p60) == -(std::int64_t{1} << 60));
static_assert(floor_to_int64(-0.5) == -1 && floor_to_int64(4294967296.5) == 4294967296);

TEST_CASE("floor_to_int64: equals std::floor on random numbers of every size") {
  constexpr std::uint64_t kSeed = 4;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (int round = 0; round < 20000; ++round) {
    const double value = std::ldexp(random.uniform(-1.0, 1.0), random.below(62));
    REQUIRE(static_cast<double>(floor_to_int64(value)) == std::floor(value));
  }
}

TEST_CASE("Lattice: a point of doubles is in its own voxel, not in that of the nearest floats") {
  const Lattice lattice(0.1);
  const Point3d p(800000.099, 0.05, 0.05);
  REQUIRE(*lattice.voxel_of(p) == VoxelCoord{8000000, 0, 0});
  REQUIRE(*lattice.voxel_of(p + Point3d::Zero()) == VoxelCoord{8000000, 0, 0});
  REQUIRE(*lattice.voxel_of(round_to_float(p)) == VoxelCoord{8000001, 0, 0});
  REQUIRE(*lattice.voxel_of(p.cast<float>()) == VoxelCoord{8000001, 0, 0});
}

TEST_CASE("Lattice: a voxel covers its lower border and not its upper one") {
  const Lattice lattice(0.5);
  CHECK(voxel(lattice, 0.0F, 0.5F, 1.0F) == VoxelCoord{0, 1, 2});
  const float below = std::nextafter(0.5F, 0.0F);
  CHECK(voxel(lattice, below, below, below) == VoxelCoord{0, 0, 0});
}

TEST_CASE("Lattice: negative coordinates floor, they do not round towards zero") {
  const Lattice lattice(0.5);
  CHECK(voxel(lattice, -0.25F, -0.5F, -0.75F) == VoxelCoord{-1, -1, -2});
  CHECK(voxel(lattice, -1e-6F, -0.0F, 1e-6F) == VoxelCoord{-1, 0, 0});
}

TEST_CASE(
    "Lattice: points on a border at a decimal resolution fall where decimal arithmetic says") {
  const Lattice lattice(0.1);
  CHECK(voxel(lattice, 0.5F, 1.0F, 2.0F) == VoxelCoord{5, 10, 20});
  CHECK(voxel(lattice, -0.5F, -1.0F, -2.0F) == VoxelCoord{-5, -10, -20});
}

TEST_CASE("Lattice: the centre of a voxel is in that voxel") {
  constexpr std::uint64_t kSeed = 5;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (const double resolution_m : {0.05, 0.1, 0.2, 0.25, 1.0, 3.0}) {
    const Lattice lattice(resolution_m);
    for (int round = 0; round < 3000; ++round) {
      const VoxelCoord v{random.below(20001) - 10000, random.below(20001) - 10000,
                         random.below(201) - 100};
      const Result<VoxelCoord> back = lattice.voxel_of(lattice.center_of(v).cast<float>());
      REQUIRE(back.ok());
      REQUIRE(*back == v);
    }
  }
}

TEST_CASE("Lattice: a point lies within half an edge of its voxel's centre on each axis") {
  constexpr std::uint64_t kSeed = 6;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  const Lattice lattice(0.1);
  for (int round = 0; round < 5000; ++round) {
    const Point3f p{static_cast<float>(random.uniform(-200.0, 200.0)),
                    static_cast<float>(random.uniform(-200.0, 200.0)),
                    static_cast<float>(random.uniform(-20.0, 20.0))};
    const Result<VoxelCoord> v = lattice.voxel_of(p);
    REQUIRE(v.ok());
    REQUIRE((p.cast<double>() - lattice.center_of(*v)).cwiseAbs().maxCoeff() <= 0.05 + 1e-9);
  }
}

TEST_CASE("Lattice: the centre is half an edge from the voxel's corner, on both sides of zero") {
  const Lattice lattice(0.2);
  CHECK(lattice.center_of({0, -1, 4}).x() == Approx(0.1));
  CHECK(lattice.center_of({0, -1, 4}).y() == Approx(-0.1));
  CHECK(lattice.center_of({0, -1, 4}).z() == Approx(0.9));
}

TEST_CASE("Lattice: a point that is not finite is out of range, on whichever axis") {
  const Lattice lattice(0.1);
  for (const float bad : {kNaN, kInfinity, -kInfinity}) {
    CHECK(lattice.voxel_of({bad, 0.0F, 0.0F}).status() == Status::kOutOfRange);
    CHECK(lattice.voxel_of({0.0F, bad, 0.0F}).status() == Status::kOutOfRange);
    CHECK(lattice.voxel_of({0.0F, 0.0F, bad}).status() == Status::kOutOfRange);
  }
}

TEST_CASE("Lattice: the grid ends at -2^23 (inside) and 2^23 (outside) voxels on every axis") {
  const Lattice lattice(1.0);
  constexpr float kLimit = 8388608.0F;
  static_assert(kVoxelLimit == 8388608);
  for (int axis = 0; axis < 3; ++axis) {
    Point3f p = Point3f::Zero();
    p[axis] = -kLimit;
    CHECK(lattice.voxel_of(p).ok());
    p[axis] = std::nextafter(-kLimit, -kInfinity);
    CHECK(lattice.voxel_of(p).status() == Status::kOutOfRange);
    p[axis] = std::nextafter(kLimit, 0.0F);
    CHECK(lattice.voxel_of(p).ok());
    p[axis] = kLimit;
    CHECK(lattice.voxel_of(p).status() == Status::kOutOfRange);
  }
}

TEST_CASE("Lattice: the outermost voxels of the grid are found with their coordinates") {
  const Lattice lattice(1.0);
  CHECK(voxel(lattice, -8388608.0F, 0.0F, 8388607.5F) ==
        VoxelCoord{-kVoxelLimit, 0, kVoxelLimit - 1});
}

TEST_CASE("Lattice: finite points far outside the grid are refused, not wrapped round") {
  const Lattice lattice(0.1);
  for (const float far : {1e9F, -1e9F, 3e38F, -3e38F}) {
    CHECK(lattice.voxel_of({far, 0.0F, 0.0F}).status() == Status::kOutOfRange);
  }
}

TEST_CASE("in_grid: voxels up to and not beyond the limit, on every axis") {
  for (const std::int32_t inside : {-kVoxelLimit, -1, 0, kVoxelLimit - 1}) {
    CHECK((in_grid(VoxelCoord{inside, 0, 0}) && in_grid(VoxelCoord{0, inside, 0}) &&
           in_grid(VoxelCoord{0, 0, inside})));
  }
  for (const std::int32_t outside : {-kVoxelLimit - 1, kVoxelLimit}) {
    CHECK_FALSE((in_grid(VoxelCoord{outside, 0, 0}) || in_grid(VoxelCoord{0, outside, 0}) ||
                 in_grid(VoxelCoord{0, 0, outside})));
  }
}

}  // namespace
}  // namespace tessera
