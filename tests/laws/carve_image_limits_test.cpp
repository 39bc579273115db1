// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Carving by the image of the scan where memory, scratch, work or time end it.
#include <catch2/catch.hpp>

#include "laws/image_scenes.hpp"
#include "laws/moved_clocks.hpp"

namespace tessera::oracle {

TEST_CASE("carving by the image: where memory is short, what is near is freed first") {
  MapConfig map = uncapped_map(0.1);
  map.storage_bytes = std::size_t{4} << 20U;
  Mapper mapper(map, by_image(25.0), 5, {.points = 60000, .tiles = 8192, .ray_blocks = 60000});
  const Cloud scan = scan_of([](double, double) { return 24.0; }, -10.0, 10.0, 1.0, 0.4);
  const ScanReport first = mapper.integrate(scan, pose_at({0.05, 0.05, 0.05}));
  const ScanReport again = mapper.integrate(scan, pose_at({0.05, 0.05, 0.05}));
  CHECK(first.free_blocks_refused > 0);
  CHECK(again.free_blocks_refused > 0);
  CHECK(first.write_faults + again.write_faults == 0);
  double farthest = 0.0;
  for (const auto& [voxel, evidence] : observed_voxels(mapper.map())) {
    if (evidence.sigma[0] > 0.0F)
      farthest = std::max(
          farthest, 0.1 * std::hypot(static_cast<double>(voxel[0]), static_cast<double>(voxel[1]),
                                     static_cast<double>(voxel[2])));
  }
  CHECK(is_free(mapper, {2.05, 0.05, 0.05}));
  CHECK(farthest < 20.0);
}

TEST_CASE("carving by the image: the budget of work and the scratch end it, and it is counted") {
  const bool by_work = GENERATE(true, false);
  InferenceConfig config = by_image(25.0);
  const Cloud scan = scan_of([](double, double) { return 24.0; }, -10.0, 10.0, 1.0, 0.4);
  config.work_budget = by_work ? 100'000 : 0;
  Mapper mapper(uncapped_map(0.1), config, 5,
                {.points = 60000, .tiles = 60000, .ray_blocks = by_work ? 60000U : 700U});
  const ScanReport report = mapper.integrate(scan, pose_at({0.05, 0.05, 0.05}));
  CHECK(report.carving_cut == 1);
  CHECK(report.admitted == report.thinned);
  if (by_work) CHECK(report.work_spent() <= report.work_predicted);
  if (by_work) CHECK(report.work_predicted <= config.work_budget);
  CHECK(report.free_blocks > 100);
  // Faces take turns, so that in the end each is freed.
  for (int i = 0; i < 48; ++i)
    static_cast<void>(mapper.integrate(scan, pose_at({0.05, 0.05, 0.05})));
  for (const auto& [x, y] : {std::pair{2.05, 0.05}, {-2.05, 0.05}, {0.05, 2.05}, {0.05, -2.05}})
    CHECK(is_free(mapper, {x, y, 0.05}));
}

TEST_CASE("carving by the image: a deadline cuts free space before labels") {
  const Cloud scan = scan_of([](double, double) { return 24.0; }, -10.0, 10.0, 1.0, 0.4);
  Mapper mapper(uncapped_map(0.1), by_image(25.0), 5,
                {.points = 60000, .tiles = 60000, .ray_blocks = 60000});
  StepClock clock{.step_us = 20};
  Deadline deadline(clock.clock(), 30.0);
  const ScanReport report = mapper.integrator().integrate(
      mapper.map(), scan.view(pose_at({0.05, 0.05, 0.05})), deadline, 8000);
  CHECK(report.admitted == report.thinned);
  CHECK(report.points_kept() > 0);
  CHECK(report.carving_cut == 1);
}

}  // namespace tessera::oracle
