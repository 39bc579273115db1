// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The nearest obstacle against a look at every voxel, and rays through a reader against cast_ray.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <tuple>

#include "support/sample_map.hpp"
#include "tessera/map/nearest_occupied.hpp"
#include "tessera/map/queries.hpp"
#include "tessera/map/reader_ray.hpp"

namespace tessera {
namespace {

struct Found {
  double squared = std::numeric_limits<double>::infinity();  ///< In voxels.
  VoxelCoord voxel{};
};

/// Every voxel within reach, one by one.
Found brute_force(const LocalMap& map, const NearestQuery& query, int reach) {
  Found best;
  const double resolution_m = map.config().resolution_m;
  const double limit = query.radius_m / resolution_m;
  const Point3d p = query.p_map.cast<double>() / resolution_m;
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const VoxelCoord voxel{x, y, z};
        const Estimate estimate = map.query(voxel);
        if (estimate.state != VoxelState::kOccupied) continue;
        if (query.classes != 0 && (query.classes >> estimate.label & 1U) == 0) continue;
        double squared = 0.0;
        const int low[] = {x, y, z};
        for (int axis = 0; axis < 3; ++axis) {
          const double at = p[axis];
          const double off = std::max({low[axis] - at, at - (low[axis] + 1), 0.0});
          squared += off * off;
        }
        // In this order of voxels the first of equals is the one in (z, y, x) order.
        if (squared <= limit * limit && squared < best.squared) best = {squared, voxel};
      }
    }
  }
  return best;
}

struct Workspace {
  explicit Workspace(const MapReader& reader) : words(reader.snapshot_bytes() / 8 + 1) {}
  std::span<std::byte> bytes() { return std::as_writable_bytes(std::span(words)); }
  std::vector<std::uint64_t> words;
};

NearestOccupied nearest(const LocalMap& map, const NearestQuery& query) {
  MapReader reader(map);
  Workspace workspace(reader);
  const Result<NearestOccupied> found =
      nearest_occupied(reader, map.lattice(), map.reading(), query, workspace.bytes());
  REQUIRE(found.ok());
  return *found;
}

NearestQuery random_query(SampleRandom& random) {
  NearestQuery query;
  for (int axis = 0; axis < 3; ++axis)
    query.p_map[axis] = static_cast<float>(random.uniform(-3.0, 3.0));
  query.radius_m = random.uniform(0.05, 5.0);
  if (random.integer(0, 1) == 1) query.classes = 1U << random.integer(1, 3);
  return query;
}

/// As a cast_ray that reads each voxel.
RayHit walked(const LocalMap& map, MapReader& reader, const Point3f& from, const Point3f& direction,
              bool stop_at_unknown) {
  const ReaderRay ray =
      cast_ray(reader, map.lattice(), from, direction, 4.0, stop_at_unknown, 1 << 20);
  CHECK_FALSE(ray.broken_off);
  CHECK(ray.voxels <= static_cast<int>(4.0 / 0.1 * std::sqrt(3.0) + 4.0));
  return ray.hit;
}

TEST_CASE("the nearest obstacle is the one that a look at every voxel finds") {
  SampleRandom random(23);
  for (const int count : {3, 40, 900}) {
    const SmallMap sample = sample_map(static_cast<std::uint64_t>(count), count, 24, 400);
    int hits = 0;
    for (int trial = 0; trial < 60; ++trial) {
      const NearestQuery query = random_query(random);
      INFO("seed 23, " << count << " observations, trial " << trial);
      const Found expected = brute_force(sample.map, query, 25);
      const NearestOccupied found = nearest(sample.map, query);
      REQUIRE(found.complete);
      REQUIRE(found.found == std::isfinite(expected.squared));
      if (!found.found) {
        CHECK(found.searched_m == Approx(query.radius_m));
        continue;
      }
      ++hits;
      CHECK(found.voxel == expected.voxel);
      CHECK(found.distance_m == Approx(0.1 * std::sqrt(expected.squared)).margin(1e-12));
      CHECK(found.estimate.label == sample.map.query(found.voxel).label);
    }
    CHECK(hits > 5);
  }
}

TEST_CASE("a search that ends with its budget says within what it is right, and is") {
  SampleRandom random(29);
  const SmallMap sample = sample_map(7, 60, 24, 400);
  int incomplete = 0;
  for (int trial = 0; trial < 200; ++trial) {
    NearestQuery query = random_query(random);
    query.max_work = 1 << random.integer(0, 8);
    const NearestOccupied found = nearest(sample.map, query);
    CHECK(found.work < query.max_work + kNearestBlockWork);
    if (found.complete) continue;
    ++incomplete;
    INFO("seed 29, trial " << trial);
    const Found truth = brute_force(sample.map, query, 25);
    // What is nearer than that has been found, and is what was found.
    if (0.1 * std::sqrt(truth.squared) < found.searched_m) {
      CHECK(found.found);
      CHECK(found.voxel == truth.voxel);
    }
    CHECK(found.searched_m <= query.radius_m + 1e-12);
  }
  CHECK(incomplete > 50);
}

TEST_CASE("the nearest obstacle: within the voxel, at the radius, in a corner of the grid") {
  SmallMap sample(config_of_pages(64), kSampleClasses);
  observe(sample.map, {{{10, 0, 0}, 2, 1.0F}});
  NearestQuery query{.p_map = {1.05F, 0.05F, 0.05F}, .radius_m = 0.5};
  CHECK(nearest(sample.map, query).distance_m == 0.0);
  query.p_map.x() = 0.05F;
  query.radius_m = 0.94;
  CHECK_FALSE(nearest(sample.map, query).found);
  query.radius_m = 0.96;
  const NearestOccupied found = nearest(sample.map, query);
  REQUIRE(found.found);
  CHECK(found.distance_m == Approx(0.95));
  query.classes = 1U << 1U;
  CHECK_FALSE(nearest(sample.map, query).found);
  // Most of what is around the corner is no block at all: work ends all the same.
  const double corner_m = 0.1 * (kVoxelLimit - 4);
  query.p_map = Point3f::Constant(static_cast<float>(-corner_m));
  query.radius_m = 1000.0;
  const NearestOccupied corner = nearest(sample.map, query);
  CHECK_FALSE(corner.complete);
  CHECK(corner.searched_m > 0.0);
  CHECK(corner.work == query.max_work);
}

TEST_CASE("the nearest obstacle: blocks that are too far off or in no grid are work too") {
  SmallMap sample(config_of_pages(64), kSampleClasses);
  observe(sample.map, {{{9, 4, 4}, 2, 1.0F}});
  // Of the 27 blocks around, one has something; some are farther off than the radius.
  NearestQuery query{.p_map = {0.15F, 0.45F, 0.45F}, .radius_m = 0.8};
  const NearestOccupied found = nearest(sample.map, query);
  CHECK(found.complete);
  CHECK(found.work == 27 - 1 + kNearestBlockWork);
  // An eighth of the blocks around a corner is in the grid.
  query.p_map = Point3f::Constant(static_cast<float>(-0.1 * (kVoxelLimit - 4)));
  query.max_work = 1000;
  const auto work_within = [&](double radius_m) {
    query.radius_m = radius_m;
    const NearestOccupied corner = nearest(sample.map, query);
    CHECK(corner.complete == (radius_m < 10.0));
    return corner.work;
  };
  CHECK(work_within(0.8) == 3 * 3 * 3);
  CHECK(work_within(3.0) == 9 * 9 * 9);
  CHECK(work_within(100.0) == 1000);
}

TEST_CASE("the nearest obstacle: each refusal") {
  const SmallMap sample = sample_map(1);
  MapReader reader(sample.map);
  Workspace workspace(reader);
  const auto status = [&](const NearestQuery& query, std::span<std::byte> memory) {
    return nearest_occupied(reader, sample.map.lattice(), sample.map.reading(), query, memory)
        .status();
  };
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  CHECK(status({.radius_m = 1.0}, workspace.bytes()) == Status::kOk);
  CHECK(status({.radius_m = 0.0}, workspace.bytes()) == Status::kInvalidArgument);
  CHECK(status({.radius_m = static_cast<double>(kNaN)}, workspace.bytes()) ==
        Status::kInvalidArgument);
  CHECK(status({.radius_m = 1e9}, workspace.bytes()) == Status::kInvalidArgument);
  CHECK(status({.radius_m = 1.0, .max_work = NearestQuery::kMostWork + 1}, workspace.bytes()) ==
        Status::kInvalidArgument);
  CHECK(status({.radius_m = 1.0}, workspace.bytes().first(100)) == Status::kInvalidArgument);
  CHECK(status({.radius_m = 1.0}, workspace.bytes().subspan(1)) == Status::kInvalidArgument);
  CHECK(status({.p_map = {kNaN, 0, 0}, .radius_m = 1.0}, workspace.bytes()) == Status::kOutOfRange);
  CHECK(status({.p_map = {1e9F, 0, 0}, .radius_m = 1.0}, workspace.bytes()) == Status::kOutOfRange);
}

TEST_CASE("a ray through a reader ends where cast_ray ends, to the last bit") {
  SampleRandom random(31);
  const SmallMap sample = sample_map(1, 900, 12, 200);
  MapReader reader(sample.map);
  int ends[4] = {};
  for (int trial = 0; trial < 300; ++trial) {
    Point3f from, direction;
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = static_cast<float>(random.uniform(-1.5, 1.5));
      direction[axis] = static_cast<float>(random.uniform(-1.0, 1.0));
    }
    const bool stop_at_unknown = trial % 3 == 0;
    const RayHit expected = cast_ray(sample.map, from, direction, 4.0, stop_at_unknown);
    const RayHit hit = walked(sample.map, reader, from, direction, stop_at_unknown);
    INFO("seed 31, trial " << trial);
    REQUIRE(hit.end == expected.end);
    CHECK(hit.voxel == expected.voxel);
    CHECK(hit.distance_m == expected.distance_m);
    CHECK(hit.estimate.label == expected.estimate.label);
    ++ends[static_cast<int>(hit.end)];
  }
  CHECK(ends[static_cast<int>(RayHit::End::kOccupied)] > 20);
  CHECK(ends[static_cast<int>(RayHit::End::kMaxRange)] > 20);
  CHECK(ends[static_cast<int>(RayHit::End::kUnknown)] > 20);
}

TEST_CASE("a ray through a reader breaks off where its budget ends, and says how far it saw") {
  SmallMap sample(config_of_pages(64), kSampleClasses);
  observe(sample.map, {{{20, 0, 0}, 2, 1.0F}});
  MapReader reader(sample.map);
  const Point3f from{0.05F, 0.05F, 0.05F};
  const auto ray = [&](int max_voxels) {
    return cast_ray(reader, sample.map.lattice(), from, {1, 0, 0}, 5.0, false, max_voxels);
  };
  const ReaderRay short_one = ray(20);
  CHECK(short_one.broken_off);
  CHECK(short_one.voxels == 20);
  CHECK(short_one.hit.distance_m == Approx(1.95));
  CHECK(short_one.hit.end == RayHit::End::kMaxRange);
  CHECK(ray(21).hit.end == RayHit::End::kOccupied);
  CHECK_FALSE(ray(21).broken_off);
  CHECK(cast_ray(reader, sample.map.lattice(), from, {0, 0, 0}, 5.0, false, 9).hit.end ==
        RayHit::End::kInvalid);
}

}  // namespace
}  // namespace tessera
