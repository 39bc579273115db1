// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The team clears together: what one robot has and another one sees through later is gone for all,
// whatever their clocks say; and one that lies makes no hole.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "member.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

/// A wall 12 m ahead of all robots, and before it, 8 m ahead, a box or none. All stand in one place
/// of the global frame, each in a map frame of its own.
class Watchers {
 public:
  explicit Watchers(int robots, bool signs = true) {
    for (int i = 0; i < robots; ++i) {
      RobotConfig config = small_robot_config(static_cast<std::uint32_t>(i));
      config.T_global_map = shift_of(1.2 * i, -0.8 * i);
      config.inference.thinning_m = 0.0;
      config.inference.mode = InferenceMode::kCounting;
      config.exchange.contributions = 12;
      config.global.replicas.contributions = 12;
      members_.push_back(std::make_unique<Member>(config, signs));
      REQUIRE(members_.back()->one.robot != nullptr);
      // Nobody's clock is another one's.
      clocks_us_.push_back(1'000'000 + i * 3'600'000'000);
    }
  }
  [[nodiscard]] Robot& robot(int i) const { return members_[static_cast<std::size_t>(i)]->robot(); }
  ScanReport scan(int i, bool has_box) {
    std::vector<float> points;
    std::vector<std::uint8_t> components;
    for (double e = -5.0; e <= 5.0; e += 0.4) {
      for (double a = -8.0; a <= 8.0; a += 0.15) {
        const double y = std::tan(a * kRadian);
        const double z = std::tan(e * kRadian) / std::cos(a * kRadian);
        const bool is_box = has_box && std::fabs(8.0 * y) < 0.5 && std::fabs(8.0 * z) < 0.5;
        const double x = is_box ? 8.0 : 12.0;
        for (const double c : {x, x * y, x * z}) points.push_back(static_cast<float>(c));
        components.push_back(is_box ? 1 : 2);
      }
    }
    const ScanView view{
        .T_map_sensor = product(inverse(robot(i).config().T_global_map), shift_of(0.1, 0.1)),
        .points = points.data(),
        .stride_floats = 3,
        .count = components.size(),
        .components = components.data()};
    return robot(i).integrate(view, clocks_us_[static_cast<std::size_t>(i)]);
  }
  /// All tick and hear each other, for so many ticks. Each clock goes at a rate of its own.
  void talk(int ticks) {
    for (; ticks > 0; --ticks) {
      for (std::size_t i = 0; i < members_.size(); ++i) {
        clocks_us_[i] += kTick_us + static_cast<std::int64_t>(i) * 400;
        static_cast<void>(members_[i]->robot().tick(clocks_us_[i]));
      }
      for (std::size_t from = 0; from < members_.size(); ++from) {
        std::array<std::byte, kMostDatagramBytes> datagram;
        while (const std::size_t size = members_[from]->robot().send(clocks_us_[from], datagram))
          for (std::size_t to = 0; to < members_.size(); ++to)
            if (to != from)
              members_[to]->robot().receive(std::span(datagram).first(size), clocks_us_[to]);
      }
    }
    for (const auto& member : members_) member->robot().finish();
  }
  void scan_and_talk(int i, bool has_box, int scans) {
    for (; scans > 0; --scans) {
      static_cast<void>(scan(i, has_box));
      talk(2);
    }
  }
  [[nodiscard]] VoxelState state(int i, double x, double y, double z) const {
    return robot(i)
        .global()
        .map()
        .query(Point3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)))
        .state;
  }
  /// In the global map of robot i: of the box, and of the wall behind it.
  [[nodiscard]] int box_voxels(int i) const { return occupied(i, 8.1); }
  [[nodiscard]] int wall_voxels(int i) const { return occupied(i, 12.1); }
  [[nodiscard]] bool agree() const {
    for (const auto& member : members_) {
      if (digest_of(member->robot().global().map()) != digest_of(robot(0).global().map()))
        return false;
    }
    return true;
  }

 private:
  static constexpr double kRadian = 3.14159265358979323846 / 180.0;
  [[nodiscard]] int occupied(int i, double x) const {
    int count = 0;
    for (double y = -0.7; y < 0.8; y += 0.2)
      for (double z = -0.7; z < 0.8; z += 0.2)
        for (const double at : {x - 0.2, x, x + 0.2})
          count += state(i, at, y, z) == VoxelState::kOccupied ? 1 : 0;
    return count;
  }
  std::vector<std::unique_ptr<Member>> members_;
  std::vector<std::int64_t> clocks_us_;
};

}  // namespace

TEST_CASE("team clears: what one has and another sees through later is gone for all") {
  Watchers team(3, GENERATE(true, false));
  for (int i = 0; i < 4; ++i) team.scan(0, true);
  team.talk(60);
  REQUIRE(team.box_voxels(0) > 10);
  REQUIRE(team.box_voxels(2) == team.box_voxels(0));
  const int wall = team.wall_voxels(2);
  // Robot 0 sees no more of it.
  team.scan_and_talk(1, false, 30);
  team.talk(60);
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(team.box_voxels(i) == 0);
    CHECK(team.wall_voxels(i) >= wall);
    CHECK(team.robot(i).global().report().objected_voxels > 10);
  }
  CHECK(team.agree());
  const ObjectionsReport& report = team.robot(1).sharer().objections();
  CHECK(report.objections > 0);
  CHECK(report.objected_voxels > 10);
  CHECK(team.robot(0).sharer().objections().objected_voxels == 0);
  // It comes back as soon as robot 0 sees it again.
  team.scan_and_talk(0, true, 2);
  team.talk(60);
  CHECK(team.box_voxels(2) > 10);
  CHECK(team.agree());
}

TEST_CASE("team clears: what was seen through before it was there stays") {
  Watchers team(2);
  team.scan_and_talk(1, false, 30);
  team.talk(40);
  for (int i = 0; i < 4; ++i) team.scan(0, true);
  team.talk(100);
  CHECK(team.box_voxels(0) > 10);
  CHECK(team.box_voxels(1) > 10);
  CHECK(team.robot(1).sharer().objections().watched_blocks > 0);
  CHECK(team.robot(1).sharer().objections().objections == 0);
  // One look after it was heard is not enough: it may have been taken before.
  team.scan_and_talk(1, false, 1);
  team.talk(100);
  CHECK(team.box_voxels(0) > 10);
}

TEST_CASE("team clears: an objection ends where its block is published anew, and is made again") {
  Watchers team(2);
  for (int i = 0; i < 4; ++i) team.scan(0, true);
  team.talk(60);
  team.scan_and_talk(1, false, 30);
  team.talk(200);
  REQUIRE(team.box_voxels(0) == 0);
  // Nobody looks, and nothing is said: it holds.
  team.talk(400);
  CHECK(team.box_voxels(0) == 0);
  CHECK(team.robot(1).sharer().objections().lapsed_objections == 0);
  // Robot 0 sees what is beside the box, whose blocks change; robot 1 looks on.
  for (int i = 0; i < 20; ++i) {
    team.scan_and_talk(0, false, 1);
    team.scan_and_talk(1, false, 1);
  }
  team.talk(100);
  CHECK(team.box_voxels(0) == 0);
  CHECK(team.box_voxels(1) == 0);
  CHECK(team.agree());
}

TEST_CASE("team clears: what a robot sees again is back, however much evidence there was of it") {
  Watchers team(2);
  for (int i = 0; i < 120; ++i) team.scan(0, true);  // beyond the cap
  team.talk(60);
  const int box = team.box_voxels(1);
  REQUIRE(box > 10);
  team.scan_and_talk(1, false, 30);
  team.talk(60);
  REQUIRE(team.box_voxels(1) == 0);
  team.scan_and_talk(0, true, 4);
  team.talk(60);
  CHECK(team.box_voxels(0) == box);
  CHECK(team.box_voxels(1) == box);
  CHECK(team.robot(0).sharer().objections().answered_objections > 0);
  CHECK(team.agree());
}

TEST_CASE("team clears: what was seen through in a frame that was wrong is taken back") {
  Watchers team(2);
  for (int i = 0; i < 4; ++i) team.scan(0, true);
  team.talk(60);
  team.scan_and_talk(1, false, 30);
  team.talk(60);
  REQUIRE(team.box_voxels(0) == 0);
  Matrix34d moved = team.robot(1).config().T_global_map;
  moved(1, 3) += 2.0;
  const bool is_own = GENERATE(true, false);
  if (is_own) {
    REQUIRE(team.robot(1).set_frame(0, moved) == Status::kOk);
  } else {
    moved = team.robot(0).config().T_global_map;
    moved(1, 3) += 0.2;
    REQUIRE(team.robot(0).set_frame(0, moved) == Status::kOk);
  }
  team.talk(100);
  CHECK(team.box_voxels(0) > 10);
  CHECK(team.box_voxels(1) > 10);
  CHECK(team.robot(1).sharer().objections().objections == 0);
  CHECK(team.agree());
}

TEST_CASE("team clears: where one sees a thing all the time and another never, it is there") {
  Watchers team(2);
  team.scan_and_talk(0, true, 4);
  team.talk(60);
  int gone = 0;
  for (int i = 0; i < 200; ++i) {
    team.scan_and_talk(0, true, 1);
    team.scan_and_talk(1, false, 1);
    gone += i >= 100 && team.box_voxels(1) < 10 ? 1 : 0;
  }
  CHECK(gone < 20);
  CHECK(team.robot(1).sharer().objections().lapsed_objections > 0);
}

TEST_CASE("team clears: one robot that objects to what two have is counted, and makes no hole") {
  Watchers team(3);
  for (int i = 0; i < 4; ++i) {
    team.scan(0, true);
    team.scan(1, true);
  }
  team.talk(80);
  const int box = team.box_voxels(2);
  REQUIRE(box > 10);
  // Robot 2 lies: it objects to all that the others have, in each version that it hears.
  const Replicas& replicas = team.robot(2).global().replicas();
  for (const Replicas::Slot slot : replicas.in_order()) {
    const Replicas::Contribution& one = replicas.contribution(slot);
    for (std::uint32_t number = one.first_block; number != 0;
         number = replicas.record(number).next) {
      Objection lie{.against = one.id,
                    .key = BlockKey{replicas.record(number).key},
                    .version = replicas.record(number).newest};
      lie.voxels.fill(~std::uint64_t{0});
      static_cast<void>(team.robot(2).exchange().object(lie));
    }
  }
  team.talk(200);
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(team.box_voxels(i) == box);
    CHECK(team.robot(i).global().report().disputed_voxels >= 10);
  }
  CHECK(team.agree());
}

TEST_CASE("team clears: robots that see the same object to nothing") {
  Watchers team(2);
  for (int i = 0; i < 12; ++i) {
    team.scan_and_talk(0, true, 1);
    team.scan_and_talk(1, true, 1);
  }
  team.talk(40);
  for (int i = 0; i < 2; ++i) {
    CHECK(team.robot(i).sharer().objections().objected_voxels == 0);
    CHECK(team.robot(i).global().report().objected_voxels == 0);
  }
}

TEST_CASE("team clears: a robot without objections hears those of others") {
  RobotConfig config = small_robot_config(0);
  config.objections = 0;
  SmallRobotMemory memory(config);
  REQUIRE(memory.robot != nullptr);
  const StreetPart part(1);
  std::int64_t now_us = 1'000'000;
  static_cast<void>(memory.robot->integrate(part.view(), now_us));
  CHECK(settle(*memory.robot, now_us) < 1000);
  CHECK(memory.robot->sharer().objections().watched_blocks == 0);
}

}  // namespace tessera
