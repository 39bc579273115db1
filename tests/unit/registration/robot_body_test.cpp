// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The robot's body as a sensor sees it, and where motion is taken out of a sweep.
#include "tessera/base/robot_body.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/registration/deskew.hpp"

namespace tessera {
namespace {

RobotBody body_of(const BodyBox& box) {
  RobotBody body;
  body.boxes[body.count++] = box;
  return body;
}

}  // namespace

TEST_CASE("BodyView: the short way of a far point gives what the boxes give") {
  oracle::Random random(41);
  const auto drawn = [&](double reach) { return random.uniform(-reach, reach); };
  std::size_t inside = 0;
  for (int i = 0; i < 2000; ++i) {
    RobotBody body;
    for (; body.count < 3; ++body.count) {
      BodyBox& box = body.boxes[body.count];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.low[axis] = static_cast<float>(drawn(3.0));
        box.high[axis] = box.low[axis] + static_cast<float>(0.1 + std::abs(drawn(2.0)));
      }
    }
    REQUIRE(body.is_valid());
    Matrix34d T = Matrix34d::Identity();
    T.leftCols<3>() =
        Eigen::AngleAxisd(drawn(3.0), Eigen::Vector3d(drawn(1.0), 1.0, drawn(1.0)).normalized())
            .toRotationMatrix();
    T.col(3) = Eigen::Vector3d(drawn(4.0), drawn(4.0), drawn(4.0));
    const BodyView view(body, T);
    for (int k = 0; k < 50; ++k) {
      const double reach = k % 2 == 0 ? 8.0 : 2.0;
      const Point3d p{drawn(reach), drawn(reach), drawn(reach)};
      const bool is_held = body.holds(apply(T, p));
      REQUIRE(view.holds(p, squared_norm(p)) == is_held);
      inside += is_held ? 1U : 0U;
    }
  }
  CHECK(inside > 300);
}

TEST_CASE("BodyView: no body holds anything, and no box holds what is no number") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(BodyView().holds({0, 0, 0}, 0.0));
  CHECK_FALSE(BodyView({}, Matrix34d::Identity()).holds({0, 0, 0}, 0.0));
  const RobotBody body = body_of({{1, -1, -1}, {2, 1, 1}});
  CHECK(body.holds({1, 1, -1}));
  for (int axis = 0; axis < 3; ++axis) {
    Point3d p{1.5, 0, 0};
    p[axis] = nan;
    CHECK_FALSE(body.holds(p));
    CHECK_FALSE(BodyView(body, Matrix34d::Identity()).holds(p, squared_norm(p)));
  }
}

TEST_CASE("RobotBody: a ray meets a box iff some point of it is in the box") {
  oracle::Random random(43);
  const auto drawn = [&](double reach) { return random.uniform(-reach, reach); };
  const RobotBody body = body_of({{1, -1, -0.5F}, {2, 1, 0.5F}});
  int met = 0;
  for (int i = 0; i < 4000; ++i) {
    const Point3d from{drawn(3.0), drawn(3.0), i % 4 == 0 ? 0.25 : drawn(3.0)};
    const Point3d direction{drawn(1.0), drawn(1.0), i % 4 == 0 ? 0.0 : drawn(1.0)};
    if (body.holds(from)) continue;
    bool is_met = false;
    bool is_close = false;
    for (int k = 1; k < 4000; ++k) {
      const Point3d p = from + direction * (0.01 * k);
      is_met = is_met || body.holds(p);
      is_close = is_close || body_of({{0.97F, -1.03F, -0.53F}, {2.03F, 1.03F, 0.53F}}).holds(p);
    }
    const bool found = body.is_met_by(from, direction);
    if (is_met) CHECK(found);
    if (found) CHECK(is_close);
    met += found ? 1 : 0;
  }
  CHECK(met > 100);
  CHECK_FALSE(body.is_met_by({0, 0, 0}, {-1, 0, 0}));
  CHECK_FALSE(RobotBody{}.is_met_by({0, 0, 0}, {1, 0, 0}));
}

TEST_CASE("deskew: what is on the body keeps its place, as it moves with the sensor") {
  constexpr std::int64_t kStamp_us = 50'000'000;
  AlignedMemory memory(PoseTrack::required_bytes(8));
  Arena arena = memory.arena();
  PoseTrack track = *PoseTrack::make(8, arena);
  Matrix34d T = Matrix34d::Identity();
  for (const std::int64_t at_us : {-100'000, 0}) {
    T(0, 3) = 20.0e-6 * static_cast<double>(at_us);  // 20 m/s ahead
    REQUIRE(track.add({kStamp_us + at_us, T}) == Status::kOk);
  }
  const std::vector<float> points{-1.5F, 0, 0, 7, 0, 0, -1.5F, 0, 0};
  const std::vector<float> times_s{-0.1F, -0.1F, std::numeric_limits<float>::quiet_NaN()};
  Sweep sweep{.points = {points.data(), 3, 3}, .times_s = times_s.data(), .stamp_us = kStamp_us};
  std::vector<float> out(points.size());
  DeskewConfig config;
  config.refuse_unplaced = true;
  CHECK(deskew(track, sweep, config, out).moved == 2);
  CHECK(out[0] == Approx(-3.5));
  sweep.body = body_of({{-2, -1, -1}, {-1, 1, 1}});
  const DeskewReport report = deskew(track, sweep, config, out);
  CHECK(report.moved == 1);
  CHECK(report.on_body == 2);
  CHECK(report.bad_time == 0);
  CHECK(out[0] == -1.5F);
  CHECK(out[3] == Approx(5.0));
  CHECK(out[6] == -1.5F);
  sweep.body.boxes[0].high = {1, 1, 1};
  CHECK(deskew(track, sweep, config, out).status == Status::kInvalidArgument);
}

}  // namespace tessera
