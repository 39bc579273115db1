// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the returns in each voxel were, by brute force over the points.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

using Place = std::array<double, 3>;

/// In voxels from the lower faces.
std::map<Voxel, std::vector<Place>> places_of(const std::vector<OraclePoint>& points,
                                              double resolution_m) {
  std::map<Voxel, std::vector<Place>> places;
  for (const OraclePoint& point : points) {
    const Voxel voxel = cell_of(point.p, resolution_m);
    Place place{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] = point.p[axis] / resolution_m - static_cast<double>(voxel[axis]);
    places[voxel].push_back(place);
  }
  return places;
}

/// Whether a place is in the sixths that a centroid says, or within 0.001 voxels of them.
bool is_at(const Place& place, Centroid centroid) {
  bool is = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto middle = static_cast<double>(Centroid::middle_of(centroid.levels()[axis]));
    is = is && std::fabs(middle - place[axis]) < 1.0 / 12.0 + 1e-3;
  }
  return is;
}

/// From the middle of the voxel to that of the sixths that a place is in, or that are the nearer
/// ones where it is within 0.001 voxels of others.
double most_square(const Place& place) {
  double sum = 0.0;
  for (const double along : place) {
    const auto from_middle = [](double at) { return std::floor(6.0 * at) + 0.5 - 3.0; };
    const double low = from_middle(along - 1e-3);
    const double high = from_middle(along + 1e-3);
    sum += std::max(low * low, high * high);
  }
  return sum;
}

double square_of(Centroid centroid) {
  double sum = 0.0;
  for (const int level : centroid.levels()) sum += (level - 2.5) * (level - 2.5);
  return sum;
}

InferenceConfig config_of(InferenceMode mode, double thinning_m) {
  InferenceConfig config;
  config.mode = mode;
  config.thinning_m = thinning_m;
  config.min_range_m = 0.0F;
  config.free_space.enabled = false;
  config.kernel_length_m = 0.35F;
  return config;
}

TEST_CASE(
    "centroids: a voxel has the place of the thinned point nearest to its middle, to a sixth") {
  const auto mode = GENERATE(InferenceMode::kCounting, InferenceMode::kKernel,
                             InferenceMode::kMultiEntropy, InferenceMode::kLattice);
  const double resolution_m = GENERATE(0.1, 0.25);
  const auto tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  CAPTURE(to_string(mode), resolution_m, to_string(tuple));
  Random random(announce_seed(2311));
  MapConfig map_config = uncapped_map(resolution_m);
  map_config.tuple = tuple;
  Mapper mapper(map_config, config_of(mode, 0.05), 5);
  const Cloud cloud = random_cloud(random, {.points = 3000});
  REQUIRE(mapper.integrate(cloud).admitted > 500);
  const auto places = places_of(mapper.admitted(), resolution_m);
  int with_points = 0;
  int without = 0;
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    CAPTURE(voxel[0], voxel[1], voxel[2]);
    const auto found = places.find(voxel);
    REQUIRE(evidence.centroid.known() == (found != places.end()));
    if (found == places.end()) {
      ++without;
      continue;
    }
    ++with_points;
    bool any = false;
    for (const Place& place : found->second) {
      any = any || is_at(place, evidence.centroid);
      REQUIRE(square_of(evidence.centroid) <= most_square(place));
    }
    REQUIRE(any);
  }
  CHECK(with_points > 300);
  CHECK((mode == InferenceMode::kCounting ? without == 0 : without > 300));
}

TEST_CASE("centroids: a scan that is nearer to the middle moves them, and what is freed has none") {
  Mapper mapper(uncapped_map(0.2), config_of(InferenceMode::kMultiEntropy, 0.0), 5);
  const VoxelCoord voxel{5, 5, 5};
  const auto after = [&](double x, double y, double z) {
    Cloud cloud;
    cloud.add(x, y, z, 1);
    mapper.integrate(cloud);
    return mapper.map().evidence(voxel).centroid;
  };
  CHECK(after(1.01, 1.01, 1.01) == Centroid::of_levels({0, 0, 0}));
  CHECK(after(1.19, 1.12, 1.05) == Centroid::of_levels({5, 3, 1}));
  CHECK(after(1.01, 1.01, 1.19) == Centroid::of_levels({5, 3, 1}));
  const SlabHandle block = mapper.map().find_handle(BlockCoord{0, 0, 0});
  VoxelMask all{};
  all.fill(~std::uint64_t{0});
  static_cast<void>(mapper.map().contradict(block, {}, all));
  CHECK_FALSE(mapper.map().evidence(voxel).centroid.known());
}

}  // namespace
}  // namespace tessera::oracle
