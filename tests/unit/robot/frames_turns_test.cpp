// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots compare next, and what holds meanwhile: submaps, guesses, corrections, other modes.
#include "hall_team.hpp"

namespace tessera {

TEST_CASE("frames are found: a submap that was begun later is compared too") {
  FramesTeam team(3);
  RobotConfig in_submaps = FramesTeam::config_of(0, FrameMode::kFound);
  in_submaps.most_submaps = in_submaps.exchange.own_contributions = 4;
  team.add(in_submaps);
  team.add(FramesTeam::config_of(1, FrameMode::kFound));
  Robot& robot = team.robot(0);
  add_world(with_two_labels(other_hall()), part_of_hall(0.0, 24.5, map_frame(0)),
            robot.mapper().maps().map());
  map_hall(team.robot(1), 0.0, 30.5, map_frame(1));
  team.run(15 * kOneSecond_us);
  REQUIRE(team.frames(0).frame_of(1) == nullptr);
  robot.mapper().maps().begin(true, SubmapNote{});
  team.run(5 * kOneSecond_us);
  map_hall(robot, 6.0, 26.0, map_frame(0));
  team.run(30 * kOneSecond_us);
  CHECK(error_m(team.frames(0), 0, 1) < 0.1);
  CHECK(error_m(team.frames(1), 0, 1) < 0.1);
  const std::uint32_t attempts = team.frames(0).pairs().front().attempts;
  team.run(20 * kOneSecond_us);
  INFO("at rest nothing is compared");
  CHECK(team.frames(0).pairs().front().attempts == attempts);
}

TEST_CASE("frames are refined: where a guess is too far off, robots that stand search anywhere") {
  FramesTeam team(3);
  for (std::uint32_t i = 0; i < 2; ++i) {
    RobotConfig config = FramesTeam::config_of(i, FrameMode::kRefined);
    config.frames.sigma_m = 5.0;
    config.frames.sigma_rad = 0.2;
    if (i == 1)
      config.T_global_map = product(frame_of(0.0, 0.0, 0.0, {14.0, 0.0, 0.0}),
                                    product(map_frame(0), inverse(map_frame(1))));
    team.add(config);
  }
  map_hall(team.robot(0), 0.0, 26.0, map_frame(0));
  map_hall(team.robot(1), 4.0, 30.5, map_frame(1));
  // All is there before the two hear each other.
  team.is_on = {true, false};
  team.run(10 * kOneSecond_us);
  team.is_on = {false, true};
  team.run(10 * kOneSecond_us);
  team.is_on = {true, true};
  team.run(30 * kOneSecond_us);
  for (std::size_t i = 0; i < 2; ++i) {
    const PairState& pair = team.frames(i).pairs().front();
    CHECK(pair.attempts >= 2);
    CHECK(pair.verdict == FrameVerdict::kFound);
  }
}

TEST_CASE("frames are found: a correction while maps are compared contradicts no link") {
  FramesTeam team(5);
  team.spare = 2;
  for (std::uint32_t i = 0; i < 2; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  map_hall(team.robot(0), 0.0, 30.5, map_frame(0));
  map_hall(team.robot(1), 3.0, 18.0, map_frame(1));
  team.run(60 * kOneSecond_us);
  REQUIRE(team.frames(0).pairs().front().stated);
  std::uint32_t attempts = team.frames(0).pairs().front().attempts;
  std::uint32_t most_refusals = 0;
  Matrix34d T_world_map = Matrix34d::Identity();
  double to_m = 18.0;
  int corrected = 0;
  for (int i = 0; i < 4; ++i, to_m += 3.0) {
    map_hall(team.robot(1), to_m, to_m + 3.0, map_frame(1));
    map_hall(team.robot(0), to_m - 15.0, to_m - 10.0, map_frame(0));
    team.run(60 * kOneSecond_us, [&] {
      const PairState& pair = team.frames(0).pairs().front();
      most_refusals = std::max(most_refusals, pair.refusals);
      if (pair.attempts == attempts) return;
      attempts = pair.attempts;
      ++corrected;
      T_world_map(0, 3) += 0.5;
      CHECK(team.robot(0).set_frame(0, T_world_map) == Status::kOk);
    });
  }
  CHECK(corrected > 1);
  CHECK(most_refusals == 0);
  CHECK(team.frames(0).pairs().front().stated);
}

TEST_CASE("frames are refined: another robot with a prior withdraws nobody's frame") {
  for (const double sigma_m : {0.0, 2.5}) {
    CAPTURE(sigma_m);
    FramesTeam team(3);
    const auto surveyed = [&](std::uint32_t robot) {
      RobotConfig config = FramesTeam::config_of(robot, FrameMode::kRefined);
      config.frames.sigma_m = sigma_m;
      config.frames.sigma_rad = 0.03 * sigma_m;
      return config;
    };
    RobotConfig rough = FramesTeam::config_of(2, FrameMode::kRefined);
    rough.T_global_map = product(frame_of(0.0, 0.0, 0.0, {1.0, -1.0, 0.5}),
                                 product(map_frame(0), inverse(map_frame(1))));
    RobotConfig late = surveyed(0);
    late.T_global_map = product(map_frame(0), inverse(map_frame(2)));
    team.add(surveyed(1));
    team.add(rough);
    team.add(late);
    team.is_on[2] = false;
    map_hall(team.robot(0), 0.0, 26.0, map_frame(0));
    map_hall(team.robot(1), 4.0, 30.5, map_frame(1));
    map_hall(team.robot(2), 2.0, 28.0, map_frame(2));
    team.run(40 * kOneSecond_us);
    REQUIRE(team.frames(1).frame_of(2) != nullptr);
    const std::uint64_t withdrawals = team.frames(0).report().withdrawals;
    const std::uint64_t rebased = team.frames(0).report().rebased;
    team.is_on[2] = true;
    Matrix34d before = *team.frames(1).frame_of(2);
    const Point3d p_world = apply(rough.T_global_map, apply(map_frame(1), Point3d(15.0, 9.0, 1.0)));
    double longest_step_m = 0.0;
    bool was_there = true;
    team.run(25 * kOneSecond_us, [&] {
      const Matrix34d* const now = team.frames(1).frame_of(2);
      was_there = was_there && now != nullptr;
      if (now == nullptr) return;
      const Point3d step = apply(*now, p_world) - apply(before, p_world);
      longest_step_m = std::max(longest_step_m, norm(step));
      before = *now;
    });
    CHECK(was_there);
    CHECK(longest_step_m < 0.15);
    CHECK(team.frames(0).report().withdrawals == withdrawals);
    CHECK(team.frames(0).report().rebased == rebased);
    CHECK(team.frames(0).robots().size() == 3);
  }
}

TEST_CASE("frames are given: who publishes in a world of its own is left out") {
  FramesTeam team(7);
  team.add(FramesTeam::config_of(0, FrameMode::kGiven));
  team.add(FramesTeam::config_of(1, FrameMode::kFound));
  team.add(FramesTeam::config_of(2, FrameMode::kGiven));
  map_hall(team.robot(0), 0.0, 15.0, map_frame(0));
  map_hall(team.robot(1), 0.0, 26.0, map_frame(1));
  map_hall(team.robot(2), 12.0, 20.0, map_frame(0));
  team.run(20 * kOneSecond_us);
  FramesTeam without(7);
  without.add(FramesTeam::config_of(0, FrameMode::kGiven));
  without.add(FramesTeam::config_of(2, FrameMode::kGiven));
  map_hall(without.robot(0), 0.0, 15.0, map_frame(0));
  map_hall(without.robot(1), 12.0, 20.0, map_frame(0));
  without.run(20 * kOneSecond_us);
  CHECK(digest_of(team.robot(0).global().map()) == digest_of(without.robot(0).global().map()));
  CHECK(team.robot(0).global().is_left_out(1));
  CHECK_FALSE(team.robot(0).global().is_left_out(2));

  INFO("started anew with a frame that is given, it is there again");
  RobotConfig again = FramesTeam::config_of(1, FrameMode::kGiven);
  again.epoch = again.floor = 2;
  again.exchange.session = std::uint64_t{2} << 32U;
  team.replace(1, again);
  map_hall(team.robot(1), 20.0, 26.0, map_frame(0));
  team.run(20 * kOneSecond_us);
  CHECK_FALSE(team.robot(0).global().is_left_out(1));
  CHECK(team.robot(0).global().map().usage().label_voxels >
        without.robot(0).global().map().usage().label_voxels);
}

TEST_CASE("frames are found: a link that finds no room is tried again now and then") {
  std::uint32_t blocks = 0;
  for (const bool has_room : {true, false}) {
    CAPTURE(has_room);
    FramesTeam team(5);
    RobotConfig config = FramesTeam::config_of(0, FrameMode::kFound);
    // For the map and its prior, but for no link.
    if (!has_room) config.global.replicas.robot_blocks = blocks + 1;
    team.add(config);
    team.add(FramesTeam::config_of(1, FrameMode::kFound));
    map_hall(team.robot(0), 0.0, 30.5, map_frame(0));
    map_hall(team.robot(1), 3.0, 18.0, map_frame(1));
    team.run(20 * kOneSecond_us);
    const Replicas& replicas = team.robot(0).global().replicas();
    for (const Replicas::Slot slot : replicas.in_order())
      if (replicas.contribution(slot).id == ContributionId{0, 1, 0})
        blocks = replicas.contribution(slot).blocks;
    const std::uint64_t before = team.robot(0).exchange().report().refused_parts;
    team.run(20 * kOneSecond_us);
    const std::uint64_t refused = team.robot(0).exchange().report().refused_parts - before;
    CHECK(team.frames(0).pairs().front().no_room != has_room);
    CHECK(refused <= 11);
    CHECK((refused == 0) == has_room);
  }
}

}  // namespace tessera
