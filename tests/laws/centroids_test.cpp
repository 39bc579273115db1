// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the returns in each voxel were, by brute force over the points.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

struct Mean {
  std::array<double, 3> sum{};
  int count = 0;
};

/// In voxels from the lower faces.
std::map<Voxel, Mean> means_of(const std::vector<OraclePoint>& points, double resolution_m) {
  std::map<Voxel, Mean> means;
  for (const OraclePoint& point : points) {
    const Voxel voxel = cell_of(point.p, resolution_m);
    Mean& mean = means[voxel];
    for (std::size_t axis = 0; axis < 3; ++axis)
      mean.sum[axis] += point.p[axis] / resolution_m - static_cast<double>(voxel[axis]);
    ++mean.count;
  }
  return means;
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
    "centroids: a voxel has the mean of the scan's points in it, to a sixth; others have none") {
  const auto mode =
      GENERATE(InferenceMode::kCounting, InferenceMode::kKernel, InferenceMode::kMultiEntropy);
  const double resolution_m = GENERATE(0.1, 0.25);
  const auto tuple = GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact);
  CAPTURE(to_string(mode), resolution_m, to_string(tuple));
  Random random(announce_seed(2311));
  MapConfig map_config = uncapped_map(resolution_m);
  map_config.tuple = tuple;
  Mapper mapper(map_config, config_of(mode, 0.05), 5);
  const Cloud cloud = random_cloud(random, {.points = 3000});
  REQUIRE(mapper.integrate(cloud).admitted > 500);
  const std::map<Voxel, Mean> means = means_of(mapper.admitted(), resolution_m);
  int with_points = 0;
  int without = 0;
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    CAPTURE(voxel[0], voxel[1], voxel[2]);
    const auto found = means.find(voxel);
    REQUIRE(evidence.centroid.known() == (found != means.end()));
    if (found == means.end()) {
      ++without;
      continue;
    }
    ++with_points;
    const std::array<int, 3> levels = evidence.centroid.levels();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double mean = found->second.sum[axis] / found->second.count;
      REQUIRE(std::fabs(static_cast<double>(Centroid::middle_of(levels[axis])) - mean) <
              1.0 / 12.0 + 1e-3);
    }
  }
  CHECK(with_points > 300);
  CHECK((mode == InferenceMode::kCounting ? without == 0 : without > 300));
}

TEST_CASE("centroids: another scan moves them by one level, and what is freed has none") {
  Mapper mapper(uncapped_map(0.2), config_of(InferenceMode::kMultiEntropy, 0.0), 5);
  Cloud near_low;
  near_low.add(1.01, 1.01, 1.01, 1);
  mapper.integrate(near_low);
  const VoxelCoord voxel{5, 5, 5};
  CHECK(mapper.map().evidence(voxel).centroid == Centroid::of_levels({0, 0, 0}));
  Cloud near_high;
  near_high.add(1.19, 1.19, 1.05, 1);
  mapper.integrate(near_high);
  CHECK(mapper.map().evidence(voxel).centroid == Centroid::of_levels({1, 1, 1}));
  mapper.integrate(near_high);
  CHECK(mapper.map().evidence(voxel).centroid == Centroid::of_levels({2, 2, 1}));
  const SlabHandle block = mapper.map().find_handle(BlockCoord{0, 0, 0});
  VoxelMask all{};
  all.fill(~std::uint64_t{0});
  static_cast<void>(mapper.map().contradict(block, {}, all));
  CHECK_FALSE(mapper.map().evidence(voxel).centroid.known());
}

}  // namespace
}  // namespace tessera::oracle
