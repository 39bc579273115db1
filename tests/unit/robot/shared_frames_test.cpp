// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots in one hall that nobody has surveyed: where each is follows from what they have in common.
#include "hall_team.hpp"

namespace tessera {
TEST_CASE("frames are found: three robots that hear two thirds of each other agree to the bit") {
  FramesTeam team(1, 0.3);
  for (std::uint32_t i = 0; i < 3; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  map_hall(team.robot(0), 0.0, 26.0, map_frame(0));
  map_hall(team.robot(1), 4.0, 30.5, map_frame(1));
  map_hall(team.robot(2), 0.0, 24.0, map_frame(2));

  INFO("nobody is placed before anything is known of it: each map is its robot's own");
  team.run(kOneSecond_us / 2);
  for (std::uint32_t i = 0; i < 3; ++i) {
    CHECK(team.frames(i).frame_of(i) != nullptr);
    CHECK(team.frames(i).frame_of((i + 1) % 3) == nullptr);
  }
  team.run(40 * kOneSecond_us);
  for (std::uint32_t i = 0; i < 3; ++i) {
    INFO("as robot " << i << " has it");
    const SharedFrames& frames = team.frames(i);
    for (const PairState& pair : frames.pairs())
      UNSCOPED_INFO("robot " << pair.robot << ": " << to_string(pair.verdict) << ", sigma "
                             << pair.sigma_m << " m " << pair.sigma_rad << ", " << pair.support
                             << ", " << pair.compared << " " << pair.attempts << " attempts");
    CHECK(error_m(frames, 0, 1) < 0.1);
    CHECK(error_m(frames, 0, 2) < 0.1);
    CHECK(frames.report().digest == team.frames(0).report().digest);
    CHECK(digest_of(team.robot(i).global().map()) == digest_of(team.robot(0).global().map()));
    REQUIRE(frames.robots().size() == 3);
    for (const PlacedRobot& one : frames.robots()) {
      CHECK(one.frame.anchor == 0);
      CHECK(one.follower.arrived());
    }
    CHECK_FALSE(frames.busy());
  }
}

TEST_CASE("frames are found: a link is refined where it is as maps grow, and holds") {
  FramesTeam team(5);
  for (std::uint32_t i = 0; i < 2; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  map_hall(team.robot(0), 0.0, 26.0, map_frame(0));
  map_hall(team.robot(1), 5.0, 24.0, map_frame(1));
  team.run(20 * kOneSecond_us);
  REQUIRE(team.frames(0).pairs().size() == 1);
  const PairState before = team.frames(0).pairs().front();
  REQUIRE(before.stated);
  CHECK(before.search.compared > 0);
  map_hall(team.robot(1), 24.0, 30.5, map_frame(1));
  team.run(20 * kOneSecond_us);
  const PairState& pair = team.frames(0).pairs().front();
  CHECK(pair.attempts > before.attempts);
  CHECK(pair.compared > before.compared);
  CHECK(pair.search.compared == before.search.compared);
  CHECK(pair.verdict == FrameVerdict::kFound);
  CHECK(pair.stated);
  CHECK_FALSE(pair.in_doubt);
  CHECK(pair.agreement.agreed > before.agreement.agreed);
  CHECK(pair.support_second == before.support_second);
  CHECK(error_m(team.frames(0), 0, 1) < 0.1);
}

TEST_CASE("frames are found: where a search finds a link elsewhere, no refinement confirms it") {
  FramesTeam team(6);
  for (std::uint32_t i = 0; i < 2; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  map_hall(team.robot(0), 0.0, 30.5, map_frame(0));
  map_hall(team.robot(1), 3.0, 20.0, map_frame(1));
  team.run(20 * kOneSecond_us);
  REQUIRE(team.frames(0).pairs().front().stated);
  REQUIRE(error_m(team.frames(0), 0, 1) < 0.1);

  INFO("the other map has slipped by 1.8 m, and more and more of it is where that is");
  Matrix34d slipped = map_frame(1);
  slipped.col(3) += slipped.leftCols<3>() * Point3d(1.0, 0.0, 1.5);
  bool was_in_doubt = false;
  int searches_after_refusals = 0;
  PairState before = team.frames(0).pairs().front();
  double from_m = 3.0;
  for (int i = 0; i < 9; ++i, from_m += 3.0) {
    map_hall(team.robot(1), from_m, from_m + 3.0, slipped);
    team.run(7 * kOneSecond_us, [&] {
      const PairState& pair = team.frames(0).pairs().front();
      was_in_doubt = was_in_doubt || pair.in_doubt;
      if (pair.attempts == before.attempts) return;
      if (before.refusals > 0) {
        // A search: a refinement would be counted, or end in doubt.
        CHECK(pair.search.refinements == 0);
        CHECK_FALSE(pair.in_doubt);
        ++searches_after_refusals;
      }
      before = pair;
    });
  }
  CHECK(was_in_doubt);
  CHECK(searches_after_refusals > 0);
}

TEST_CASE("frames are found: a robot that starts anew is left out until its new map is placed") {
  FramesTeam team(2);
  for (std::uint32_t i = 0; i < 2; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  map_hall(team.robot(0), 0.0, 26.0, map_frame(0));
  map_hall(team.robot(1), 5.0, 30.5, map_frame(1));
  team.run(20 * kOneSecond_us);
  REQUIRE(error_m(team.frames(0), 0, 1) < 0.1);
  const std::uint64_t alone = team.frames(0).report().withdrawals;

  RobotConfig again = FramesTeam::config_of(1, FrameMode::kFound);
  again.epoch = again.floor = 2;
  again.exchange.session = std::uint64_t{2} << 32U;
  team.replace(1, again);
  map_hall(team.robot(1), 3.0, 30.5, map_frame(3));
  bool was_left_out = false;
  team.run(20 * kOneSecond_us,
           [&] { was_left_out = was_left_out || team.frames(0).frame_of(1) == nullptr; });
  CHECK(was_left_out);
  CHECK(team.frames(0).report().withdrawals > alone);
  const Matrix34d* const T_team_1 = team.frames(0).frame_of(1);
  REQUIRE(T_team_1 != nullptr);
  const Point3d middle(15.0, 9.0, 1.0);
  CHECK(norm(Point3d(apply(*T_team_1, apply(map_frame(3), middle)) - apply(map_frame(0), middle))) <
        0.1);
}

TEST_CASE(
    "frames are refined: a survey holds to the bit, and what was given roughly is corrected") {
  FramesTeam team(3);
  RobotConfig surveyed = FramesTeam::config_of(0, FrameMode::kRefined);
  surveyed.frames.sigma_m = surveyed.frames.sigma_rad = 0.0;
  surveyed.T_global_map = frame_of(30.0, 0.0, 0.0, {100.0, 50.0, 2.0});
  RobotConfig rough = FramesTeam::config_of(1, FrameMode::kRefined);
  const Matrix34d T_map0_map1 = product(map_frame(0), inverse(map_frame(1)));
  const Matrix34d right = product(surveyed.T_global_map, T_map0_map1);
  // 3 m and 8 degrees off.
  rough.T_global_map = product(frame_of(0.0, 0.0, 0.0, {2.0, -2.0, 1.0}),
                               product(right, frame_of(8.0, 0.0, 0.0, {0.0, 0.0, 0.0})));
  team.add(surveyed);
  team.add(rough);
  map_hall(team.robot(0), 0.0, 26.0, map_frame(0));
  map_hall(team.robot(1), 4.0, 30.5, map_frame(1));
  team.run(60 * kOneSecond_us);
  for (std::uint32_t i = 0; i < 2; ++i) {
    const SharedFrames& frames = team.frames(i);
    const Matrix34d* const of_surveyed = frames.frame_of(0);
    const Matrix34d* const of_rough = frames.frame_of(1);
    REQUIRE(of_surveyed != nullptr);
    REQUIRE(of_rough != nullptr);
    CHECK(*of_surveyed == Matrix34d(Matrix34d::Identity()));
    const Point3d p_map = apply(map_frame(1), Point3d(15.0, 9.0, 1.0));
    CHECK(norm(Point3d(apply(product(*of_rough, rough.T_global_map), p_map) -
                       apply(right, p_map))) < 0.1);
  }
}

TEST_CASE("frames are found: the memory is what the settings say") {
  const auto bytes = [](std::uint32_t robots, std::uint32_t blocks) {
    GlobalMapConfig global;
    global.replicas.blocks = blocks;
    return SharedFrames::required_bytes({.mode = FrameMode::kFound, .most_robots = robots}, global,
                                        kMaxComponents);
  };
  constexpr std::size_t kMegabyte = 1'000'000;
  CHECK(bytes(16, 0) / kMegabyte == 16);
  CHECK(bytes(64, 0) / kMegabyte == 18);
  CHECK(bytes(16, 1'024) - bytes(16, 0) == 1'024 * SharedFrames::kBlockBytes);
}

TEST_CASE("frames are found: two robots that have nothing in common have no frame in common") {
  FramesTeam team(4);
  for (std::uint32_t i = 0; i < 2; ++i) team.add(FramesTeam::config_of(i, FrameMode::kFound));
  map_hall(team.robot(0), 0.0, 26.0, map_frame(0));
  add_world(with_two_labels(other_hall()), part_of_hall(0.0, 24.5, map_frame(1)),
            team.robot(1).mapper().maps().map());
  team.run(20 * kOneSecond_us);
  for (std::uint32_t i = 0; i < 2; ++i) {
    CHECK(team.frames(i).frame_of(1 - i) == nullptr);
    REQUIRE(team.frames(i).pairs().size() == 1);
    const PairState& pair = team.frames(i).pairs().front();
    CHECK(pair.attempts >= 1);
    CHECK_FALSE(pair.stated);
    INFO("its own map is all that there is");
    CHECK(team.robot(i).global().map().usage().label_voxels ==
          team.robot(i).map().usage().label_voxels);
  }
}

}  // namespace tessera
