// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The kernel mode's strips: tiles that follow each other along x are summed up together, and the
// map is the same as of tiles one by one.
#include <catch2/catch.hpp>
#include <limits>

#include "laws/moved_clocks.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

/// Points reach two voxels at most: one unit of two.
constexpr float kLength_m = 0.15F;

InferenceConfig kernel_config() {
  InferenceConfig config;
  config.mode = InferenceMode::kKernel;
  config.kernel_length_m = kLength_m;
  config.thinning_m = 0.0;
  config.min_range_m = 0.0F;
  return config;
}

/// Without a deadline.
ScanReport in_strips(Mapper& mapper, const Cloud& cloud) { return mapper.integrate(cloud); }

/// Under a deadline that never comes, which is looked at after every tile.
ScanReport tile_by_tile(Mapper& mapper, const Cloud& cloud) {
  StepClock steps;
  Deadline deadline(steps.clock(), 1e12);
  return mapper.integrator().integrate(mapper.map(), cloud.view(), deadline,
                                       std::numeric_limits<std::int64_t>::max());
}

struct Both {
  ScanReport strips;
  ScanReport tiles;
};

Both integrate_both_ways(const Cloud& cloud) {
  Mapper a(uncapped_map(0.1), kernel_config(), 5);
  Mapper b(uncapped_map(0.1), kernel_config(), 5);
  const Both both{in_strips(a, cloud), tile_by_tile(b, cloud)};
  CHECK(same_content(a.map(), b.map()));
  CHECK(both.strips.voxel_updates == both.tiles.voxel_updates);
  CHECK(both.strips.label_octets == both.tiles.label_octets);
  CHECK(both.tiles.strips > both.strips.strips);
  return both;
}

TEST_CASE("strips: a run of tiles along x is cut into fours from its first one") {
  // Points whose balls reach from each tile 0 .. 15 into the next one, in one row of tiles.
  Cloud cloud;
  for (int i = 0; i < 15; ++i) cloud.add(0.75 + 0.8 * i, 0.35, 0.35, 1 + i % 5);
  const Both sixteen = integrate_both_ways(cloud);
  CHECK(sixteen.tiles.strips == 16);
  CHECK(sixteen.strips.strips == 4);
  // Tile -1 starts the run now.
  cloud.add(-0.05, 0.35, 0.35, 1);
  const Both seventeen = integrate_both_ways(cloud);
  CHECK(seventeen.tiles.strips == 17);
  CHECK(seventeen.strips.strips == 5);
}

TEST_CASE("strips: in a cloud of clusters and sheets most tiles have others beside them") {
  Random random(announce_seed(31));
  const Both both = integrate_both_ways(random_cloud(random, {.points = 4000, .classes = 5}));
  CHECK(2 * both.strips.strips < both.tiles.strips);
}

}  // namespace
}  // namespace tessera::oracle
