// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/vehicle_frames.hpp"

#include <catch2/catch.hpp>

#include "sample_pose.hpp"
#include "vehicle/vehicle_inputs.hpp"

namespace tessera {

namespace {

double largest_difference(const Matrix34d& a, const Matrix34d& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

}  // namespace

TEST_CASE("to_sent_pose: the angles of a pose are found again in every quarter and upside down") {
  for (const double heading : {-3.1, -1.6, -0.2, 0.0, 1.5, 3.0}) {
    for (const double pitch : {-1.57, -0.4, 0.0, 1.2}) {
      for (const double roll : {-3.0, -0.7, 0.0, 0.9, 3.1}) {
        SentPose sent = sent_pose(3.0, -4.0, heading);
        sent.pitch_rad = pitch;
        sent.roll_rad = roll;
        const SentPose found = to_sent_pose(to_transform(sent));
        CHECK(found.heading_rad == Approx(heading).margin(1e-12));
        CHECK(found.pitch_rad == Approx(pitch).margin(1e-12));
        CHECK(found.roll_rad == Approx(roll).margin(1e-9));
        CHECK(found.p_map == sent.p_map);
      }
    }
  }
}

TEST_CASE("to_sent_pose: straight up and straight down, the pose is the same by other angles") {
  for (const double pitch : {-1.5707963267948966, 1.5707963267948966}) {
    SentPose sent = sent_pose(1.0, 2.0, 0.3);
    sent.pitch_rad = pitch;
    sent.roll_rad = -0.8;
    const SentPose found = to_sent_pose(to_transform(sent));
    CHECK(found.roll_rad == 0.0);
    CHECK(largest_difference(to_transform(found), to_transform(sent)) < 1e-9);
  }
}

TEST_CASE("VehicleFrames: a pose that is too old to be said is none") {
  VehicleInputs inputs;
  VehicleFrames vehicle;
  std::int64_t now_us = 1'000'000;
  const auto invalid_after = [&](double age_ms) {
    for (int i = 0; i < 3; ++i) {
      SentPose sent = sent_pose(0.0);
      sent.age_ms = age_ms;
      for (const CanFrame& frame : vehicle.pose(sent))
        static_cast<void>(inputs.take(frame, now_us += 100));
    }
    return inputs.counters().invalid_poses;
  };
  CHECK(invalid_after(254.4) == 0);
  CHECK(invalid_after(254.6) == 3);
  CHECK(invalid_after(1e9) == 6);
}

}  // namespace tessera
