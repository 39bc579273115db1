// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The law of admission, on random scans under random limits: whatever a scan's limits leave out,
// the map is what integrating the admitted points and rays alone into an unconstrained map makes
// it, bit for bit.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

struct Setting {
  InferenceMode mode = InferenceMode::kCounting;
  int edge = 2;
};

struct Limits {
  std::size_t storage_bytes = std::size_t{16} << 20U;
  std::uint64_t work_budget = 0;
  ScanCapacity capacity = test_capacity();
};

constexpr float kRange_m = 6.0F;
constexpr int kClasses = 5;

InferenceConfig config_of(const Setting& setting, bool free_space) {
  InferenceConfig config;
  config.mode = setting.mode;
  config.entropy.block_edge = setting.edge;
  config.free_space.enabled = free_space;
  config.free_space.carving = Carving::kRays;
  config.kernel_length_m = 0.27F;
  config.min_range_m = 0.05F;
  config.max_range_m = kRange_m;
  config.thinning_m = 0.0;
  return config;
}

Point3f end_of(const Point3d& p) {
  return (p.normalized() * static_cast<double>(kRange_m)).cast<float>();
}

/// A return beyond the range whose ray, handed in again at twice the length of its end, has the
/// same end to the bit.
void add_far_ray(Random& random, Cloud& cloud) {
  for (;;) {
    const Point3f given(static_cast<float>(random.uniform(-9, 9)),
                        static_cast<float>(random.uniform(-9, 9)),
                        static_cast<float>(random.uniform(-9, 9)));
    if (given.norm() < 1.1F * kRange_m) continue;
    const Point3f end = end_of(given.cast<double>());
    if (end_of(2.0 * end.cast<double>()) != end) continue;
    cloud.add(static_cast<double>(given.x()), static_cast<double>(given.y()),
              static_cast<double>(given.z()), 1, 1.0);
    return;
  }
}

Cloud random_scan(Random& random) {
  Cloud cloud = random_cloud(
      random, {.points = 150 + random.below(250), .classes = kClasses, .weighted = true});
  const int far = random.below(3) == 0 ? 0 : random.below(40);
  for (int i = 0; i < far; ++i) add_far_ray(random, cloud);
  return cloud;
}

Limits random_limits(Random& random) {
  Limits limits;
  const int which = random.below(16);
  const auto draw = [&](double low, double high) {
    return std::exp(random.uniform(std::log(low), std::log(high)));
  };
  if ((which & 1) != 0 || which == 0)
    limits.storage_bytes = static_cast<std::size_t>(draw(4, 64)) * SlabPool::kPageBytes;
  if ((which & 2) != 0) limits.work_budget = static_cast<std::uint64_t>(draw(1, 60000));
  if ((which & 4) != 0) limits.capacity.tiles = static_cast<std::uint32_t>(draw(1, 400));
  if ((which & 8) != 0) limits.capacity.ray_blocks = static_cast<std::uint32_t>(draw(1, 900));
  return limits;
}

struct Tally {
  int refused_memory = 0;
  int refused_work = 0;
  int refused_rays = 0;
  int admitted = 0;
};

/// Two scans in a row under the limits, and their admitted parts without.
void check_law(const Setting& setting, bool free_space, std::uint64_t seed, Tally& tally) {
  Random random(seed);
  const Limits limits = random_limits(random);
  CAPTURE(seed, free_space, static_cast<int>(setting.mode), setting.edge, limits.storage_bytes,
          limits.work_budget, limits.capacity.tiles, limits.capacity.ray_blocks);
  InferenceConfig config = config_of(setting, free_space);
  MapConfig map_config = uncapped_map(0.1);
  if (random.below(2) == 0) map_config.max_evidence = 3.0F;
  MapConfig limited_map = map_config;
  limited_map.storage_bytes = limits.storage_bytes;
  InferenceConfig limited = config;
  limited.work_budget = limits.work_budget;
  Mapper mapper(limited_map, limited, kClasses, limits.capacity);
  map_config.storage_bytes = std::size_t{64} << 20U;
  Mapper reference(map_config, config, kClasses,
                   {.points = 20000, .tiles = 20000, .ray_blocks = 20000});
  for (int scan = 0; scan < 2; ++scan) {
    CAPTURE(scan);
    const ScanReport report = mapper.integrate(random_scan(random));
    CHECK(report.admitted + report.refused_memory() + report.refused_work == report.thinned);
    CHECK(report.admitted == mapper.integrator().admitted().size());
    if (free_space)
      CHECK(report.rays_refused_memory + report.rays_refused_work +
                mapper.integrator().admitted_rays().size() ==
            report.beyond_range);
    CHECK(empty_blocks(mapper.map()) == 0);
    const ScanReport expected = reference.integrate(mapper.admitted_cloud());
    CHECK(expected.left_out() == 0);
    REQUIRE(expected.admitted == report.admitted);
    REQUIRE(reference.integrator().admitted_rays().size() ==
            mapper.integrator().admitted_rays().size());
    REQUIRE(same_content(mapper.map(), reference.map()));
    CHECK(mapper.map().usage().label_voxels == reference.map().usage().label_voxels);
    tally.refused_memory += report.refused_memory() > 0 ? 1 : 0;
    tally.refused_work += report.refused_work > 0 ? 1 : 0;
    tally.refused_rays += report.rays_refused_memory + report.rays_refused_work > 0 ? 1 : 0;
    tally.admitted += report.admitted > 0 ? 1 : 0;
  }
}

const std::vector<Setting> kSettings{
    {InferenceMode::kCounting, 2},     {InferenceMode::kKernel, 2},
    {InferenceMode::kMultiEntropy, 1}, {InferenceMode::kMultiEntropy, 2},
    {InferenceMode::kLattice, 2},      {InferenceMode::kMultiEntropy, 4}};

}  // namespace

TEST_CASE("admission: the map is what the admitted points alone make of it, whatever the limits") {
  const bool free_space = GENERATE(false, true);
  const std::size_t which = GENERATE(range<std::size_t>(0, kSettings.size()));
  Tally tally;
  const std::uint64_t first = announce_seed(5000 + 1000 * which + (free_space ? 500U : 0U));
  for (std::uint64_t seed = first; seed < first + 40; ++seed)
    check_law(kSettings[which], free_space, seed, tally);
  CHECK(tally.refused_memory > 5);
  CHECK(tally.refused_work > 5);
  if (free_space) CHECK(tally.refused_rays > 5);
  CHECK(tally.admitted > 20);
}

TEST_CASE("admission: the work done stays within the budget") {
  const std::size_t which = GENERATE(range<std::size_t>(0, kSettings.size()));
  const bool free_space = GENERATE(false, true);
  CAPTURE(which, free_space);
  for (const std::uint64_t budget : {50U, 700U, 9000U, 40000U}) {
    CAPTURE(budget);
    InferenceConfig config = config_of(kSettings[which], free_space);
    config.work_budget = budget;
    Random random(6100);
    Mapper mapper(uncapped_map(0.1), config, kClasses);
    const ScanReport report = mapper.integrate(random_scan(random));
    CHECK(report.evaluations + report.ray_steps <= budget);
  }
}

TEST_CASE("admission: a ray that crosses the most voxels for its length is paid for in full") {
  // Nine voxels, and one evaluation.
  const std::uint64_t budget = GENERATE(8U, 9U, 10U);
  InferenceConfig config = config_of({InferenceMode::kCounting, 2}, true);
  config.free_space.neighbour_angle_rad = 0.0F;
  config.free_space.margin_voxels = 0.0F;
  config.work_budget = budget;
  Matrix34d T = Matrix34d::Identity();
  T.col(3) = Eigen::Vector3d(0.2, -0.05, -0.1);
  Cloud cloud;
  cloud.add(-0.2145, 0.25, -0.102, 1);
  Mapper mapper(uncapped_map(0.1), config, kClasses);
  const ScanReport report = mapper.integrate(cloud, T);
  CAPTURE(budget, report.evaluations, report.ray_steps);
  CHECK(report.evaluations + report.ray_steps <= budget);
  CHECK(report.admitted == (budget == 10 ? 1 : 0));
}

}  // namespace tessera::oracle
