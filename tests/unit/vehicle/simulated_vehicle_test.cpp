// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/simulated_vehicle.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "vehicle/vehicle_inputs.hpp"

namespace tessera {
namespace {

constexpr double kSpeed_mps = 3.0;
constexpr double kYawRate_radps = 0.4;

/// On a circle from the origin on, after so many seconds.
SentPose on_circle(double seconds) {
  const double turned = kYawRate_radps * seconds;
  SentPose pose;
  pose.p_map = Point3d(std::sin(turned), 1.0 - std::cos(turned), 0.0) * kSpeed_mps / kYawRate_radps;
  pose.p_map.z() = 0.7;
  pose.heading_rad = turned;
  return pose;
}

struct Track {
  alignas(kArenaAlignment) std::array<std::byte, PoseTrack::required_bytes(512)> memory{};
  PoseTrack track;

  explicit Track(int poses) {
    Arena arena(memory);
    track = *PoseTrack::make(512, arena);
    for (int i = 0; i < poses; ++i)
      REQUIRE(track.add({10'000 * i, to_transform(on_circle(0.01 * i))}) == Status::kOk);
  }
};

/// What became of the poses of a drive, by who hears the frames.
struct Heard {
  int usable = 0;
  double largest_error_m = 0.0;
  double largest_error_rad = 0.0;
};

Heard drive(const PoseTrack& track, VehicleInputs& inputs, PoseSource source) {
  SimulatedVehicle vehicle;
  Heard heard;
  constexpr std::int64_t kBegin_us = 5'000'000;
  constexpr std::int64_t kAge_us = 4'000;
  for (std::int64_t at_us = 0; at_us <= track.latest_us(); at_us += SimulatedVehicle::kCycle_us) {
    std::int64_t now_us = kBegin_us + at_us + kAge_us;
    for (const CanFrame& frame : vehicle.cycle(track, at_us, kAge_us)) {
      const VehicleInputs::Taken taken = inputs.take(frame, now_us);
      now_us += 300;
      if (!taken.pose || !taken.pose->usable || taken.pose->source != source) continue;
      ++heard.usable;
      const StampedPose& got = taken.pose->observation.pose;
      // Odometry is of the cycle that ends when it is sent.
      const std::int64_t stamp_us = source == PoseSource::kPose ? got.stamp_us - kBegin_us : at_us;
      const Matrix34d truth = *track.at(stamp_us, 100'000);
      heard.largest_error_m = std::max(
          heard.largest_error_m, (got.T_map_body.col(3) - truth.col(3)).cwiseAbs().maxCoeff());
      heard.largest_error_rad =
          std::max(heard.largest_error_rad, turn_between(got.T_map_body, truth));
    }
  }
  return heard;
}

}  // namespace

TEST_CASE("SimulatedVehicle: its poses are those of the track, at the times of the track") {
  const Track track(301);
  VehicleInputs inputs({.mode = PoseMode::kPose});
  const Heard heard = drive(track.track, inputs, PoseSource::kPose);
  // 151 cycles: the first has no counter to be compared with, then five good ones in a row.
  CHECK(heard.usable == 146);
  CHECK(heard.largest_error_m < 0.6e-3);
  CHECK(heard.largest_error_rad < 1.2e-4);
  CHECK(inputs.guard().count(PoseVerdict::kGood) == 146);
  const VehicleInputReport counters = inputs.counters();
  CHECK(counters.refused == 6);  // The first of each of six messages.
  CHECK(counters.foreign + counters.misshapen + counters.invalid_poses == 0);
  CHECK(counters.invalid_odometry == 0);
  CHECK(counters.commands == 0);
  CHECK(inputs.motion(8'000'000) == MotionState::kMoving);
}

TEST_CASE("SimulatedVehicle: its odometry leads around the same circle") {
  const Track track(301);
  VehicleInputs inputs({.mode = PoseMode::kOdometry});
  const Heard heard = drive(track.track, inputs, PoseSource::kOdometry);
  CHECK(heard.usable > 140);
  // The reckoned frame begins where odometry is first heard, two cycles on, and flat; so the way is
  // compared by its length alone.
  CHECK(heard.largest_error_rad < 2.5 * 0.02 * kYawRate_radps);
}

TEST_CASE("SimulatedVehicle: without a pose on the track there is none, and no odometry") {
  const Track track(51);
  SimulatedVehicle vehicle;
  CHECK(vehicle.cycle(track.track, -1, 0).size() == 3);  // Odometry, state, command.
  CHECK(vehicle.cycle(track.track, 0, 0).size() == 4);
  const auto second = vehicle.cycle(track.track, 20'000, 0);
  REQUIRE(second.size() == 4);
  CHECK(raw_of(second[3].bytes(), bus::kOdometryValid) == 1);
  CHECK(value_of(second[3].bytes(), bus::kWheelSpeed) == Approx(kSpeed_mps).margin(2e-3));
  CHECK(value_of(second[3].bytes(), bus::kYawRate) == Approx(kYawRate_radps).margin(2e-4));
  const auto beyond = vehicle.cycle(track.track, 500'001, 0);
  REQUIRE(beyond.size() == 1);
  CHECK(raw_of(beyond[0].bytes(), bus::kOdometryValid) == 0);
  CHECK(vehicle.poses() == 2);
}

}  // namespace tessera
