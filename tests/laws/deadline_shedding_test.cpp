// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a scan that is too much for its time loses: free space before labels, and of free space a
// part in all directions, another one each time.
#include <catch2/catch.hpp>
#include <numbers>

#include "laws/moved_clocks.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

constexpr std::uint32_t kPoints = 6000;
/// Work a reading of the clock, such that the writing of all labels is foreseen to take hundreds.
constexpr double kRate = 1200.0;
/// Room for the labels by their bound, and for a part of the rays.
constexpr std::int64_t kTime_us = 385;

InferenceConfig around_the_sensor() {
  InferenceConfig config;
  config.free_space.carving = Carving::kRays;
  config.min_range_m = 0.05F;
  config.max_range_m = 6.0F;
  config.thinning_m = 0.0;
  return config;
}

/// A wall all around.
Cloud room() {
  Random random(7);
  Cloud cloud;
  while (cloud.size() < kPoints) {
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    const double height_m = random.uniform(-1.0, 1.0);
    cloud.add(4.0 * std::cos(angle), 4.0 * std::sin(angle), height_m,
              1 + static_cast<int>(cloud.size() % 3));
  }
  return cloud;
}

ScanReport integrate_in(Mapper& mapper, std::int64_t time_us, double rate = kRate) {
  StepClock steps;
  Deadline deadline(steps.clock(), rate);
  const Cloud cloud = room();
  return mapper.integrator().integrate(mapper.map(), cloud.view(), deadline, time_us);
}

}  // namespace

TEST_CASE("deadline: where labels fit all points are admitted, and rays are what gives way") {
  Mapper mapper(uncapped_map(0.1), around_the_sensor(), 5);
  Mapper whole(uncapped_map(0.1), around_the_sensor(), 5);
  const ScanReport expected = whole.integrate(room());
  const ScanReport report = integrate_in(mapper, kTime_us);
  CHECK(report.admitted == kPoints);
  CHECK(report.refused_deadline == 0);
  CHECK(report.points_kept() == kPoints);
  CHECK(report.rays_wanted() == kPoints);
  CHECK(report.rays > kPoints / 10);
  CHECK(report.rays_cut > kPoints / 10);
  CHECK(report.voxel_updates == expected.voxel_updates);
  CHECK(mapper.map().usage().label_voxels == whole.map().usage().label_voxels);
  CHECK(mapper.map().count_free_voxels() < whole.map().count_free_voxels());
}

TEST_CASE("deadline: where labels do not fit, most of the time is for them, and some for rays") {
  Mapper mapper(uncapped_map(0.1), around_the_sensor(), 5);
  const ScanReport report = integrate_in(mapper, kTime_us / 2);
  CHECK(report.refused_deadline > kPoints / 10);
  CHECK(report.admitted > kPoints / 4);
  CHECK(report.rays > 0);
}

TEST_CASE("deadline: a robot that stands sees along all rays in the end") {
  Mapper mapper(uncapped_map(0.1), around_the_sensor(), 5);
  Mapper whole(uncapped_map(0.1), around_the_sensor(), 5);
  whole.integrate(room());
  std::uint32_t traced = 0;
  int scans = 0;
  for (; traced < 2 * kPoints; ++scans) {
    const ScanReport report = integrate_in(mapper, kTime_us);
    REQUIRE(report.rays > 0);
    if (scans == 0) REQUIRE(mapper.map().count_free_voxels() < whole.map().count_free_voxels());
    traced += report.rays;
  }
  CHECK(mapper.map().count_free_voxels() == whole.map().count_free_voxels());
}

TEST_CASE("deadline: no more time is kept for labels than half as much again as they took lately") {
  Mapper mapper(uncapped_map(0.1), around_the_sensor(), 5);
  const std::uint32_t first = integrate_in(mapper, kTime_us).rays;
  const std::uint32_t second = integrate_in(mapper, kTime_us).rays;
  CHECK(second > first);
}

}  // namespace tessera::oracle
