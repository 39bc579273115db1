// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Deskewing of directions from which nothing came back.
#include <catch2/catch.hpp>

#include "support/random.hpp"
#include "tessera/base/rigid.hpp"
#include "unit/registration/swept_drive.hpp"

namespace tessera {

TEST_CASE("deskew: a direction without a return is turned, not shifted") {
  oracle::Random random(93);
  SweptCloud cloud;
  std::vector<std::uint8_t> no_return;
  std::vector<Eigen::Vector3d> expected;
  const auto turn_of = [](double time_s) {
    return Eigen::Matrix3d(product(driven(time_s), mounted()).leftCols<3>());
  };
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d d_map(random.uniform(-1, 1), random.uniform(-1, 1),
                                random.uniform(-1, 1));
    const auto time_s = static_cast<float>(-0.05 + 0.0002 * i);
    const Eigen::Vector3d d = turn_of(static_cast<double>(time_s)).transpose() * d_map;
    for (int axis = 0; axis < 3; ++axis) cloud.points.push_back(static_cast<float>(d[axis]));
    cloud.points.push_back(0.0F);
    cloud.times_s.push_back(time_s);
    no_return.push_back(i % 5 == 0 ? 0 : 1);
    expected.emplace_back(turn_of(0.0).transpose() * d_map);
  }
  DrivenTrack t;
  t.drive(-60'000, 60'000, 10'000);
  Sweep sweep = cloud.sweep();
  sweep.no_return = no_return.data();
  std::vector<float> out(cloud.points.size(), 0.0F);
  REQUIRE(deskew(t.track, sweep, {}, out).moved == 500);
  double worst = 0.0;
  double least_shift_m = 1.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Eigen::Vector3f got(out[4 * i], out[4 * i + 1], out[4 * i + 2]);
    const double off = (got.cast<double>() - expected[i]).norm();
    if (no_return[i] != 0) {
      worst = std::max(worst, off);
    } else if (std::fabs(cloud.times_s[i]) > 0.03F) {
      least_shift_m = std::min(least_shift_m, off);
    }
  }
  CHECK(worst < 1e-4);
  CHECK(least_shift_m > 0.05);
}

}  // namespace tessera
