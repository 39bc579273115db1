// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Deskewing puts each point where the sensor would have seen it at the scan's stamp; what it cannot
// place it leaves or refuses, and counts.
#include "tessera/registration/deskew.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "support/random.hpp"
#include "tessera/base/internal/digest.hpp"
#include "tessera/base/rigid.hpp"
#include "unit/registration/swept_drive.hpp"

namespace tessera {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Places fixed in the map, as the moving sensor sees each at its time.
SweptCloud drawn_sweep(std::uint64_t seed, int count, double first_s, double last_s,
                       std::vector<Eigen::Vector3d>* at_stamp = nullptr) {
  oracle::Random random(seed);
  SweptCloud cloud;
  const Matrix34d T_map_stamp = product(driven(0.0), mounted());
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(-40, 40);
    const double y = random.uniform(-40, 40);
    const Eigen::Vector3d p_map(x, y, random.uniform(-2, 5));
    const auto time_s = static_cast<float>(first_s + (last_s - first_s) * i / count);
    const Matrix34d T_map_sensor = product(driven(static_cast<double>(time_s)), mounted());
    const Point3d p = apply(inverse(T_map_sensor), p_map);
    for (int axis = 0; axis < 3; ++axis) cloud.points.push_back(static_cast<float>(p[axis]));
    cloud.points.push_back(static_cast<float>(i));
    cloud.times_s.push_back(time_s);
    if (at_stamp != nullptr) at_stamp->push_back(apply(inverse(T_map_stamp), p_map));
  }
  return cloud;
}

TEST_CASE("deskew: what stands still comes out where the sensor sees it at the stamp") {
  std::vector<Eigen::Vector3d> expected;
  const SweptCloud cloud = drawn_sweep(91, 5000, -0.05, 0.05, &expected);
  DrivenTrack t;
  t.drive(-60'000, 60'000, 10'000);
  std::vector<float> out(cloud.points.size(), 0.0F);
  const DeskewReport report = deskew(t.track, cloud.sweep(), {}, out);
  REQUIRE(report.status == Status::kOk);
  CHECK(report.moved == 5000);
  CHECK(report.knots <= 32);
  CHECK(report.knots_without_pose == 0);
  double worst_m = 0.0;
  double skew_m = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Eigen::Vector3f got(out[4 * i], out[4 * i + 1], out[4 * i + 2]);
    const Eigen::Vector3f raw(cloud.points[4 * i], cloud.points[4 * i + 1],
                              cloud.points[4 * i + 2]);
    worst_m = std::max(worst_m, (got.cast<double>() - expected[i]).norm());
    skew_m = std::max(skew_m, (raw.cast<double>() - expected[i]).norm());
  }
  CHECK(skew_m > 2.0);
  // Mostly the drive's own curve between poses 10 ms apart.
  CHECK(worst_m < 0.003);
}

TEST_CASE("deskew: knots cost at most range * turn^2 / 8, against a pose for every point") {
  const SweptCloud cloud = drawn_sweep(92, 4000, -0.1, 0.0);
  DrivenTrack t;
  t.drive(-100'000, 0, 1'000);
  const Sweep sweep = cloud.sweep();
  for (const int knots : {2, 8, 32, 64}) {
    std::vector<float> out(cloud.points.size(), 0.0F);
    DeskewConfig config;
    config.knots = knots;
    REQUIRE(deskew(t.track, sweep, config, out).moved == 4000);
    const Matrix34d T_stamp_map = inverse(product(*t.track.at(kSweepStamp_us, 5000), mounted()));
    const double turn = 0.15 / (knots - 1) * 1.2;
    for (std::size_t i = 0; i < cloud.times_s.size(); ++i) {
      const auto at =
          static_cast<std::int64_t>(std::lround(static_cast<double>(cloud.times_s[i]) * 1e6));
      const Matrix34d T =
          product(T_stamp_map, product(*t.track.at(kSweepStamp_us + at, 5000), mounted()));
      const Eigen::Vector3d p(static_cast<double>(cloud.points[4 * i]),
                              static_cast<double>(cloud.points[4 * i + 1]),
                              static_cast<double>(cloud.points[4 * i + 2]));
      const Eigen::Vector3d got(static_cast<double>(out[4 * i]),
                                static_cast<double>(out[4 * i + 1]),
                                static_cast<double>(out[4 * i + 2]));
      // Half a microsecond of the drive is 10 um. Its acceleration is 18 m/s^2: 0.03 m and less.
      REQUIRE((got - apply(T, p)).norm() <
              p.norm() * turn * turn / 8.0 + 2e-4 + 0.03 / ((knots - 1) * (knots - 1)));
    }
  }
}

TEST_CASE("deskew: in place gives the same, and leaves what follows the coordinates") {
  SweptCloud cloud = drawn_sweep(93, 300, -0.05, 0.05);
  DrivenTrack t;
  t.drive(-60'000, 60'000, 10'000);
  std::vector<float> out(cloud.points.size(), 7.0F);
  REQUIRE(deskew(t.track, cloud.sweep(), {}, out).moved == 300);
  REQUIRE(deskew(t.track, cloud.sweep(), {}, cloud.points).moved == 300);
  for (std::size_t i = 0; i < 300; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      REQUIRE(out[4 * i + axis] == cloud.points[4 * i + axis]);
    REQUIRE(out[4 * i + 3] == 7.0F);
    REQUIRE(cloud.points[4 * i + 3] == static_cast<float>(i));
  }
}

TEST_CASE("deskew: a robot that stands moves nothing by more than rounding") {
  const SweptCloud cloud = drawn_sweep(94, 300, 0.0, 0.0);
  DrivenTrack t;
  REQUIRE(t.track.add({kSweepStamp_us - 100'000, driven(0.0)}) == Status::kOk);
  REQUIRE(t.track.add({kSweepStamp_us, driven(0.0)}) == Status::kOk);
  std::vector<float> out(cloud.points.size());
  SweptCloud spread = cloud;
  for (std::size_t i = 0; i < 300; ++i) spread.times_s[i] = -0.0003F * static_cast<float>(i);
  REQUIRE(deskew(t.track, spread.sweep(), {}, out).moved == 300);
  for (std::size_t i = 0; i < 300; ++i) REQUIRE(std::abs(out[4 * i] - cloud.points[4 * i]) < 1e-5F);
}

TEST_CASE("deskew: points without a usable time, or that are not finite, are counted apart") {
  SweptCloud cloud = drawn_sweep(95, 6, -0.05, 0.05);
  DrivenTrack t;
  t.drive(-60'000, 60'000, 10'000);
  cloud.times_s[1] = kNaN;
  cloud.times_s[2] = 0.51F;
  cloud.times_s[3] = -std::numeric_limits<float>::infinity();
  cloud.points[4 * 4] = kNaN;
  for (const bool refuse : {false, true}) {
    std::vector<float> out(cloud.points.size());
    DeskewConfig config;
    config.refuse_unplaced = refuse;
    const DeskewReport report = deskew(t.track, cloud.sweep(), config, out);
    CHECK(report.moved == 2);
    CHECK(report.bad_time == 3);
    CHECK(report.non_finite == 1);
    CHECK(report.without_pose == 0);
    CHECK(std::isnan(out[4 * 2]) == refuse);
    if (!refuse) CHECK(out[4 * 2 + 1] == cloud.points[4 * 2 + 1]);
    CHECK_FALSE(std::isnan(out[0]));
  }
}

TEST_CASE("deskew: a part of the sweep without poses stays, the rest is moved") {
  const SweptCloud cloud = drawn_sweep(96, 1000, -0.1, 0.1);
  DrivenTrack t;
  t.drive(-110'000, 40'000, 10'000);  // the latest poses are not there yet
  std::vector<float> out(cloud.points.size());
  const DeskewReport report = deskew(t.track, cloud.sweep(), {}, out);
  REQUIRE(report.status == Status::kOk);
  CHECK(report.knots_without_pose > 0);
  CHECK(report.moved > 600);
  CHECK(report.moved + report.without_pose == 1000);
  CHECK(out[4 * 999] == cloud.points[4 * 999]);
}

TEST_CASE("deskew: a gap in the poses is not bridged") {
  const SweptCloud cloud = drawn_sweep(97, 1000, -0.1, 0.0);
  DrivenTrack t;
  t.drive(-110'000, -90'000, 10'000).drive(-20'000, 0, 10'000);
  DeskewConfig config;
  config.max_gap_us = 50'000;
  std::vector<float> out(cloud.points.size());
  const DeskewReport report = deskew(t.track, cloud.sweep(), config, out);
  CHECK(report.without_pose > 600);
  CHECK(report.moved > 200);
}

TEST_CASE("deskew: without a pose at the stamp nothing is written") {
  const SweptCloud cloud = drawn_sweep(98, 10, -0.1, 0.0);
  DrivenTrack t;
  std::vector<float> out(cloud.points.size(), 5.0F);
  CHECK(deskew(t.track, cloud.sweep(), {}, out).status == Status::kOutOfRange);
  t.drive(-110'000, -10'000, 10'000);
  CHECK(deskew(t.track, cloud.sweep(), {}, out).status == Status::kOutOfRange);
  CHECK(out == std::vector<float>(cloud.points.size(), 5.0F));
}

TEST_CASE("deskew: no points, and arguments out of range") {
  DrivenTrack t;
  t.drive(-60'000, 60'000, 10'000);
  std::vector<float> out(400);
  Sweep none;
  none.stamp_us = kSweepStamp_us;
  CHECK(deskew(t.track, none, {}, out).status == Status::kOk);
  const SweptCloud cloud = drawn_sweep(99, 100, -0.05, 0.05);
  const auto refused = [&](auto change) {
    Sweep sweep = cloud.sweep();
    DeskewConfig config;
    change(sweep, config);
    return deskew(t.track, sweep, config, out).status == Status::kInvalidArgument;
  };
  CHECK_FALSE(refused([](Sweep&, DeskewConfig&) {}));
  CHECK(refused([](Sweep&, DeskewConfig& c) { c.knots = 1; }));
  CHECK(refused([](Sweep&, DeskewConfig& c) { c.knots = DeskewConfig::kMostKnots + 1; }));
  CHECK(refused([](Sweep&, DeskewConfig& c) { c.most_s = 10.5; }));
  CHECK(refused([](Sweep&, DeskewConfig& c) { c.most_s = static_cast<double>(kNaN); }));
  CHECK(refused([](Sweep&, DeskewConfig& c) { c.max_gap_us = -1; }));
  CHECK(refused([](Sweep& s, DeskewConfig&) { s.times_s = nullptr; }));
  CHECK(refused([](Sweep& s, DeskewConfig&) { s.points.stride_floats = 2; }));
  CHECK(refused([](Sweep& s, DeskewConfig&) { s.points.count = 101; }));
  CHECK(refused([](Sweep& s, DeskewConfig&) { s.T_body_sensor.setZero(); }));
  CHECK(refused(
      [](Sweep& s, DeskewConfig&) { s.stamp_us = std::numeric_limits<std::int64_t>::max(); }));
  CHECK(refused(
      [](Sweep& s, DeskewConfig&) { s.stamp_us = std::numeric_limits<std::int64_t>::min(); }));
}

TEST_CASE("golden digest: a deskewed sweep is the same to the bit on every machine") {
  oracle::Random random(100);
  DrivenTrack t(16);
  for (int i = 0; i <= 10; ++i) {
    // Turns by multiples of the 3-4-5 triangle's angle, without libm.
    Matrix34d T = Matrix34d::Identity();
    Matrix34d turn;
    turn << 0.8, -0.6, 0, 0.3, 0.6, 0.8, 0, 0.1, 0, 0, 1, 0.01;
    for (int n = 0; n < i; ++n) T = product(turn, T);
    REQUIRE(t.track.add({kSweepStamp_us + 10'000 * i, T}) == Status::kOk);
  }
  SweptCloud cloud;
  for (int i = 0; i < 3000; ++i) {
    for (int axis = 0; axis < 4; ++axis)
      cloud.points.push_back(static_cast<float>(random.uniform(-50, 50)));
    cloud.times_s.push_back(static_cast<float>(random.uniform(0.0, 0.1)));
  }
  Sweep sweep = cloud.sweep();
  sweep.T_body_sensor = Matrix34d::Identity();
  REQUIRE(deskew(t.track, sweep, {}, cloud.points).moved == 3000);
  Digest digest;
  for (const float number : cloud.points) digest.add_float(number);
  CHECK(digest.value() == 0x1a3a2a7f17258ce5U);
}

}  // namespace
}  // namespace tessera
