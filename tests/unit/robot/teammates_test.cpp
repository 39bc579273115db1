// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Two robots that meet: what one maps of the other, as long as it is heard and after that.
#include <catch2/catch.hpp>

#include "member.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

/// A robot at a place of the global frame, in a map frame of its own, which looks around itself: it
/// sees the other one and a wall behind it.
struct Meeting {
  static RobotConfig config_of(std::uint32_t number, bool has_body = true) {
    RobotConfig config = small_robot_config(number);
    config.T_global_map = shift_of(number == 0 ? 3.0 : -7.0, 2.0);
    config.inference.thinning_m = 0.0;
    if (has_body) {
      config.inference.body.count = 2;
      config.inference.body.boxes[0] = {{-1.0F, -0.6F, -0.4F}, {1.0F, 0.6F, -0.1F}};
      config.inference.body.boxes[1] = {{-0.5F, -0.6F, -0.4F}, {-0.2F, 0.6F, 0.8F}};
    }
    return config;
  }
  explicit Meeting(bool has_body = true, bool signs = true)
      : zero(config_of(0, has_body), signs), one(config_of(1, has_body), signs) {
    for (double y = -0.55; y < 0.6; y += 0.1) {
      for (double z = -0.35; z < 0.7; z += 0.1) {
        add(4.4, y, z);  // The other robot's side.
        add(9.0, 3.0 + y, z);
      }
    }
  }
  void add(double x, double y, double z) {
    for (const double c : {x, y, z}) points.push_back(static_cast<float>(c));
    components.push_back(1);
  }
  [[nodiscard]] ScanView view(const Member& member, double x_global) const {
    const Matrix34d T_global_sensor = shift_of(x_global, 0.0);
    return {.T_map_sensor = product(inverse(member.robot().config().T_global_map), T_global_sensor),
            .points = points.data(),
            .stride_floats = 3,
            .count = components.size(),
            .components = components.data()};
  }
  /// Zero is at 0, one 5 m before it, turned to it; both scan ten times a second.
  ScanReport scan(std::int64_t for_us, bool one_is_on = true) {
    ScanReport report;
    for (const std::int64_t end_us = now_us + for_us; now_us < end_us; now_us += 100'000) {
      report = zero.robot().integrate(view(zero, 0.0), now_us);
      if (one_is_on) static_cast<void>(one.robot().integrate(view(one, 5.0), now_us));
      exchange(zero, one);
      if (one_is_on) exchange(one, zero);
    }
    return report;
  }
  void exchange(const Member& from, const Member& to) const {
    std::array<std::byte, kMostDatagramBytes> datagram;
    static_cast<void>(from.robot().tick(now_us));
    while (const std::size_t size = from.robot().send(now_us, datagram))
      to.robot().receive(std::span(datagram).first(size), now_us);
  }
  /// Zero has something where it saw the other one.
  [[nodiscard]] bool maps_other() const {
    const Point3d p_map =
        apply(inverse(zero.robot().config().T_global_map), Point3d(4.4, 0.1, 0.1));
    const VoxelEvidence evidence = zero.robot().map().evidence(round_to_float(p_map));
    return evidence.sigma[1] > 0.0F;
  }
  Member zero;
  Member one;
  std::vector<float> points;
  std::vector<std::uint8_t> components;
  std::int64_t now_us = 1'000'000;
};

}  // namespace

TEST_CASE("teammates: two robots that hear each other map each other not, and say where they are") {
  const bool signs = GENERATE(true, false);
  Meeting meeting(true, signs);
  // The first scan is before anything was heard.
  Meeting silent(false, signs);
  CHECK(silent.scan(500'000).on_teammate == 0);
  CHECK(silent.maps_other());
  CHECK(silent.zero.robot().sharer().teammates(silent.now_us) == 0);
  meeting.exchange(meeting.one, meeting.zero);
  static_cast<void>(meeting.one.robot().integrate(meeting.view(meeting.one, 5.0), meeting.now_us));
  for (int i = 0; i < 5; ++i) meeting.exchange(meeting.one, meeting.zero);
  const ScanReport report = meeting.scan(2'000'000);
  CHECK(report.teammates == 1);
  CHECK(report.on_teammate == meeting.components.size() / 2);
  CHECK_FALSE(meeting.maps_other());
  const Result<TeammatePlace> place = meeting.zero.robot().sharer().teammate_at(0, meeting.now_us);
  REQUIRE(place.ok());
  CHECK(place->robot == 1);
  CHECK(norm(place->T_map_body.col(3) - Point3d(5, 0, 0)) < 0.002);
  CHECK(place->box.low[0] == Approx(-1.0));
  CHECK(place->box.high[2] == Approx(0.8).margin(0.011));
  CHECK(meeting.zero.robot().sharer().teammate_at(1, meeting.now_us).status() ==
        Status::kOutOfRange);
}

TEST_CASE("teammates: one that is not heard any more is an obstacle like any other") {
  Meeting meeting;
  static_cast<void>(meeting.one.robot().integrate(meeting.view(meeting.one, 5.0), meeting.now_us));
  for (int i = 0; i < 5; ++i) meeting.exchange(meeting.one, meeting.zero);
  CHECK(meeting.scan(2'000'000).teammates == 1);
  CHECK(meeting.scan(2'500'000, false).on_teammate > 0);
  CHECK_FALSE(meeting.maps_other());
  CHECK(meeting.scan(1'500'000, false).on_teammate == 0);
  CHECK(meeting.maps_other());
  CHECK(meeting.zero.robot().sharer().teammates(meeting.now_us) == 0);
}

TEST_CASE("teammates: a frame that is corrected moves a robot with it") {
  Meeting meeting;
  meeting.scan(1'000'000);
  const Matrix34d moved = product(shift_of(0.0, 1.0), meeting.one.robot().config().T_global_map);
  REQUIRE(meeting.one.robot().set_frame(0, moved) == Status::kOk);
  meeting.scan(2'500'000);
  const Result<TeammatePlace> place = meeting.zero.robot().sharer().teammate_at(0, meeting.now_us);
  REQUIRE(place.ok());
  CHECK(norm(place->T_map_body.col(3) - Point3d(5, 1, 0)) < 0.002);
}

TEST_CASE("teammates: nothing of where robots are is in what they publish") {
  Meeting meeting;
  Meeting silent(false);
  meeting.scan(2'000'000);
  silent.scan(2'000'000);
  for (const Meeting* one : {&meeting, &silent}) {
    std::vector<ContributionState> all(8);
    all.resize(one->zero.robot().exchange().contributions(all));
    CHECK(all.size() == 2);
  }
  CHECK(meeting.zero.robot().exchange().report().presences > 0);
  CHECK(silent.zero.robot().exchange().report().presences == 0);
}

TEST_CASE("teammates: a body that is too large to be told is not, and its scans are as before") {
  RobotConfig config = Meeting::config_of(0);
  config.inference.body.boxes[1] = {{-9.0F, -0.6F, -0.4F}, {9.0F, 0.6F, -0.1F}};
  const Member large(config, true);
  CHECK_FALSE(large.robot().sharer().tells_place());
  CHECK(Member(Meeting::config_of(0), true).robot().sharer().tells_place());
  CHECK_FALSE(Member(Meeting::config_of(0, false), true).robot().sharer().tells_place());
  for (const double margin_m : {-0.1, 2.1, std::numeric_limits<double>::quiet_NaN()}) {
    RobotConfig bad = Meeting::config_of(0);
    bad.teammate_margin_m = margin_m;
    AlignedMemory memory(Robot::required_bytes(bad, small_robot_classes().num_components()));
    Arena arena = memory.arena();
    CHECK(Robot::make(arena, bad, small_robot_classes(), {}, {}).status() ==
          Status::kInvalidArgument);
  }
}

}  // namespace tessera
