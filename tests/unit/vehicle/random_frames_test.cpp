// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A vehicle that drives among ten thousand frames that are not its own, or no longer.
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "sample_pose.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"
#include "vehicle/vehicle_inputs.hpp"

namespace tessera {
namespace {

void check_sums(const VehicleInputs& inputs) {
  const VehicleInputReport c = inputs.counters();
  REQUIRE(c.frames == c.foreign + c.misshapen + c.refused + c.accepted);
  std::uint64_t judged = 0;
  for (const std::uint64_t count : c.by_status) judged += count;
  REQUIRE(judged == c.refused + c.accepted);
  const auto of = [&](E2eStatus status) { return c.by_status[static_cast<std::size_t>(status)]; };
  REQUIRE(c.accepted == of(E2eStatus::kOk) + of(E2eStatus::kOkSomeLost));
}

CanFrame random_frame(oracle::Random& random, const std::vector<CanFrame>& recorded) {
  CanFrame frame;
  const int kind = random.below(4);
  if (kind == 0) {  // Anything.
    frame.id = static_cast<std::uint32_t>(random.below(0x800));
  } else if (kind == 1 || recorded.empty()) {  // One of ours by its identifier and size.
    frame.id = kDefaultBaseId + static_cast<std::uint32_t>(random.below(7));
    frame.is_fd = frame.id == kDefaultBaseId + bus::kIdPoseFd;
  } else {  // One from before, as it was or damaged.
    frame = recorded[static_cast<std::size_t>(random.below(static_cast<int>(recorded.size())))];
    if (kind == 3) {
      const int byte = random.below(frame.size);
      const int bit = random.below(8);
      frame.data[static_cast<std::size_t>(byte)] ^= static_cast<std::uint8_t>(1U << bit);
    }
    return frame;
  }
  const BusMessage* const message = bus_message(frame.id - kDefaultBaseId);
  frame.size = static_cast<std::uint8_t>(random.below(frame.is_fd ? 65 : 9));
  if (kind == 1 && message != nullptr && random.below(4) > 0) frame.size = message->size;
  for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random.below(256));
  return frame;
}

TEST_CASE("VehicleInputs: 10,000 random, damaged and replayed frames, and no wrong pose is used") {
  oracle::Random random(oracle::announce_seed(7401));
  VehicleInputs inputs({.mode = PoseMode::kPose});
  VehicleFrames vehicle;
  std::vector<CanFrame> recorded;
  std::int64_t now_us = 1'000'000;
  std::uint64_t used = 0;
  int hostile = 0;
  for (double x = 0.0; hostile < 10'000; x += 0.02) {
    const std::int64_t begin_us = now_us;
    const auto pose = vehicle.pose(sent_pose(x));
    const std::array frames{pose[0], pose[1], pose[2], vehicle.odometry({1.0, 0.0})};
    for (const CanFrame& frame : frames) {
      now_us += 200;
      const auto check = [&](const VehicleInputs::Taken& taken) {
        REQUIRE_FALSE(taken.command.has_value());
        if (!taken.pose.has_value() || !taken.pose->usable) return;
        ++used;
        // What is used is the pose that the vehicle sent just now, or the one before.
        const PoseObservation& got = taken.pose->observation;
        REQUIRE(std::abs(got.pose.T_map_body(0, 3) - x) <= 0.0205);
        REQUIRE(now_us - got.pose.stamp_us <= 40'000);
      };
      check(inputs.take(frame, now_us));
      const int between = random.below(4);
      for (int i = 0; i < between; ++i, ++hostile) {
        now_us += 50;
        check(inputs.take(random_frame(random, recorded), now_us));
      }
      if (recorded.size() < 400) recorded.push_back(frame);
      check_sums(inputs);
    }
    now_us = begin_us + 20'000;
  }
  CHECK(inputs.counters().foreign > 1000);
  CHECK(inputs.counters().misshapen > 500);
  CHECK(inputs.counters().by_status[static_cast<std::size_t>(E2eStatus::kWrongCrc)] > 2000);
  CHECK(inputs.counters().by_status[static_cast<std::size_t>(E2eStatus::kRepeated)] > 10);
  CHECK(used > 0);
}

TEST_CASE("VehicleInputs: among damaged frames alone the vehicle's poses stay good") {
  oracle::Random random(oracle::announce_seed(7402));
  VehicleInputs inputs({.mode = PoseMode::kPose});
  VehicleFrames vehicle;
  std::int64_t now_us = 1'000'000;
  int good = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t begin_us = now_us;
    for (const CanFrame& frame : vehicle.pose(sent_pose(0.02 * i))) {
      now_us += 300;
      CanFrame damaged = frame;
      const int bit = random.below(64);
      damaged.data[static_cast<std::size_t>(bit / 8)] ^= static_cast<std::uint8_t>(1U << (bit % 8));
      static_cast<void>(inputs.take(damaged, now_us));
      const auto taken = inputs.take(frame, now_us);
      good += taken.pose.has_value() && taken.pose->usable ? 1 : 0;
    }
    now_us = begin_us + 20'000;
  }
  CHECK(good == 995);
}

}  // namespace
}  // namespace tessera
