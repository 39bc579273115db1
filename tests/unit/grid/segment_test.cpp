// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A walk along a segment visits the cells that the segment crosses, each once, from one end to the
// other.
#include "tessera/grid/internal/segment.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

struct Visit {
  VoxelCoord cell;
  double t = 0.0;
};

std::vector<Visit> walk(const Point3d& a, const Point3d& b) {
  std::vector<Visit> visits;
  const bool finished = walk_segment(a, b, [&](int x, int y, int z, double t) {
    visits.push_back({{x, y, z}, t});
    return true;
  });
  REQUIRE(finished);
  return visits;
}

std::vector<VoxelCoord> cells(const Point3d& a, const Point3d& b) {
  std::vector<VoxelCoord> result;
  for (const Visit& visit : walk(a, b)) result.push_back(visit.cell);
  return result;
}

VoxelCoord cell_of(const Point3d& p) {
  return {static_cast<std::int32_t>(std::floor(p.x())),
          static_cast<std::int32_t>(std::floor(p.y())),
          static_cast<std::int32_t>(std::floor(p.z()))};
}

using Cells = std::vector<VoxelCoord>;

TEST_CASE("walk_segment: a segment inside one cell visits that cell") {
  CHECK(cells({0.2, 0.3, 0.4}, {0.8, 0.1, 0.9}) == Cells{{0, 0, 0}});
  CHECK(cells({-0.2, -0.3, -0.4}, {-0.2, -0.3, -0.4}) == Cells{{-1, -1, -1}});
}

TEST_CASE("walk_segment: along an axis, across zero, in both directions") {
  CHECK(cells({-1.5, 0.5, 0.5}, {1.5, 0.5, 0.5}) ==
        Cells{{-2, 0, 0}, {-1, 0, 0}, {0, 0, 0}, {1, 0, 0}});
  CHECK(cells({0.5, 0.5, 1.5}, {0.5, 0.5, -1.5}) ==
        Cells{{0, 0, 1}, {0, 0, 0}, {0, 0, -1}, {0, 0, -2}});
}

TEST_CASE("walk_segment: through an edge or a corner, x steps before y before z") {
  CHECK(cells({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}) ==
        Cells{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}});
}

TEST_CASE("walk_segment: ends on a border are in the cell above it, as points are") {
  CHECK(cells({0.0, 0.5, 0.5}, {2.0, 0.5, 0.5}) == Cells{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}});
  CHECK(cells({2.0, 0.5, 0.5}, {0.0, 0.5, 0.5}) == Cells{{2, 0, 0}, {1, 0, 0}, {0, 0, 0}});
}

TEST_CASE("walk_segment: t is the part of the segment before the cell") {
  const std::vector<Visit> visits = walk({0.5, 0.5, 0.5}, {4.5, 0.5, 0.5});
  REQUIRE(visits.size() == 5);
  CHECK(visits[0].t == 0.0);
  CHECK(visits[1].t == Approx(0.125));
  CHECK(visits[4].t == Approx(0.875));
}

TEST_CASE("walk_segment: stops where the visitor says, and says that it was stopped") {
  int count = 0;
  CHECK_FALSE(walk_segment(Point3d{0.5, 0.5, 0.5}, Point3d{9.5, 0.5, 0.5},
                           [&](int, int, int, double) { return ++count < 3; }));
  CHECK(count == 3);
}

TEST_CASE(
    "walk_segment: random segments step from cell to neighbour, from first to last, t never "
    "falling") {
  constexpr std::uint64_t kSeed = 41;
  oracle::Random random(kSeed);
  for (int round = 0; round < 5000; ++round) {
    INFO("seed " << kSeed << ", round " << round);
    const double reach = std::ldexp(1.0, random.below(7));
    const auto end = [&] {
      const double x = random.uniform(-reach, reach);
      const double y = random.uniform(-reach, reach);
      return Point3d{x, y, random.uniform(-reach, reach)};
    };
    const Point3d a = end();
    Point3d b = end();
    if (round % 4 == 0) b.z() = a.z();
    const std::vector<Visit> visits = walk(a, b);
    REQUIRE(visits.front().cell == cell_of(a));
    REQUIRE(visits.back().cell == cell_of(b));
    const Point3d d = b - a;
    REQUIRE(static_cast<double>(visits.size()) < d.cwiseAbs().sum() + 4.0);
    for (std::size_t i = 1; i < visits.size(); ++i) {
      const VoxelCoord& from = visits[i - 1].cell;
      const VoxelCoord& to = visits[i].cell;
      REQUIRE(std::abs(to.x - from.x) + std::abs(to.y - from.y) + std::abs(to.z - from.z) == 1);
      REQUIRE(visits[i].t >= visits[i - 1].t);
      REQUIRE(visits[i].t <= 1.0 + 1e-9);
    }
  }
}

TEST_CASE("walk_segment: the middle of every stay lies in the cell visited") {
  constexpr std::uint64_t kSeed = 42;
  oracle::Random random(kSeed);
  for (int round = 0; round < 2000; ++round) {
    INFO("seed " << kSeed << ", round " << round);
    const Point3d a{random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0), -3.3};
    const Point3d b{random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0),
                    random.uniform(-9.0, 9.0)};
    const std::vector<Visit> visits = walk(a, b);
    for (std::size_t i = 0; i < visits.size(); ++i) {
      const double leaves = i + 1 < visits.size() ? visits[i + 1].t : 1.0;
      if (leaves - visits[i].t < 1e-9) continue;
      const Point3d middle = a + (b - a) * (0.5 * (visits[i].t + leaves));
      REQUIRE(cell_of(middle) == visits[i].cell);
    }
  }
}

}  // namespace
}  // namespace tessera
