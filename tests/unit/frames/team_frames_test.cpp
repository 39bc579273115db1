// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/team_frames.hpp"

#include <bit>
#include <limits>

#include "team_scene.hpp"

namespace tessera {
namespace {

bool equal_bits(const Matrix34d& a, const Matrix34d& b) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      if (std::bit_cast<std::uint64_t>(a(row, column)) !=
          std::bit_cast<std::uint64_t>(b(row, column)))
        return false;
    }
  }
  return true;
}

/// Twelve robots of which some lie, with revisions, priors and withdrawals.
TeamScene crowded_scene(std::uint64_t seed) {
  TeamScene scene(seed, 12);
  for (std::size_t i = 0; i < 12; ++i) {
    for (std::size_t j = 0; j < 12; ++j) {
      if (i == j || scene.random.below(3) == 0) continue;
      if (scene.random.below(6) == 0) {
        scene.state_falsely(i, j, {scene.random.uniform(-9, 9), 3, 0});
      } else {
        scene.state(i, j);
      }
      if (scene.random.below(5) == 0) {
        scene.links.back().revision = 2;
        scene.state_falsely(i, j, {100, 0, 0});
      }
      if (scene.random.below(9) == 0) scene.links.back().withdrawn = true;
    }
  }
  scene.priors.push_back({30, scene.T_world_robot[2], true, {}});
  scene.priors.push_back({70, scene.T_world_robot[6], false,
                          FrameCovariance::isotropic(scene.T_world_robot[6].col(3), 0.5, 0.1)});
  return scene;
}

TEST_CASE("TeamFrames: the order of links, priors and members does not change a bit") {
  TeamScene scene = crowded_scene(301);
  TeamSolver one;
  TeamSolver other;
  const TeamSolution first = one.solve(scene);
  for (std::uint32_t i = 0; i < scene.links.size(); ++i) scene.links[i].from_version = i;
  for (int round = 0; round < 30; ++round) {
    scene.shuffle(scene.links);
    scene.shuffle(scene.priors);
    scene.shuffle(scene.members);
    const TeamSolution again = other.solve(scene);
    REQUIRE(again.digest == first.digest);
    for (std::size_t i = 0; i < first.frames.size(); ++i) {
      REQUIRE(equal_bits(first.frames[i].T_team_robot, again.frames[i].T_team_robot));
      REQUIRE(first.frames[i].joined_by == again.frames[i].joined_by);
    }
    for (std::size_t i = 0; i < scene.links.size(); ++i) {
      const FrameLinkReport& before = first.links[scene.links[i].from_version];
      REQUIRE(before.verdict == again.links[i].verdict);
      REQUIRE(before.sigmas == again.links[i].sigmas);
    }
  }
}

TEST_CASE("TeamFrames: nothing is left from call to call") {
  TeamSolver fresh;
  TeamSolver used;
  const TeamScene scene = crowded_scene(302);
  const std::uint64_t digest = fresh.solve(scene).digest;
  static_cast<void>(used.solve(crowded_scene(303)));
  CHECK(used.solve(scene).digest == digest);
  CHECK(used.solve(crowded_scene(303)).digest != digest);
}

TEST_CASE("TeamFrames: of a pair's links the latest counts, and a withdrawal is one") {
  TeamScene scene(304, 2);
  scene.state_falsely(0, 1, {30, 0, 0});
  scene.state_both(0, 1);
  scene.links[1].revision = 2;
  TeamSolver solver;
  TeamSolution solution = solver.solve(scene);
  CHECK(solution.links[0].verdict == LinkVerdict::kReplaced);
  CHECK(solution.links[1].verdict == LinkVerdict::kUsed);
  CHECK(solution.links[2].verdict == LinkVerdict::kUsed);
  CHECK(solution.groups == 1);
  for (FrameLink link : {scene.links[1], scene.links[2]}) {
    link.revision = 3;
    link.withdrawn = true;
    scene.links.push_back(link);
  }
  solution = solver.solve(scene);
  CHECK(solution.groups == 2);
  CHECK(solution.links[3].verdict == LinkVerdict::kWithdrawn);
  CHECK(solution.links[1].verdict == LinkVerdict::kReplaced);
  for (const RobotFrame& frame : solution.frames) {
    CHECK(frame.state == FrameState::kWithdrawn);
    CHECK(frame.T_team_robot == Matrix34d::Identity());
  }
}

TEST_CASE("TeamFrames: two contents of one revision name their author, whichever came first") {
  TeamScene scene(305, 3);
  scene.state_both(0, 1);
  scene.state_both(1, 2);
  scene.state(0, 2);
  scene.state(0, 2);
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.links[4].verdict == LinkVerdict::kTwoContents);
  CHECK(solution.links[5].verdict == LinkVerdict::kTwoContents);
  CHECK(solution.frames[0].suspected);
  CHECK_FALSE(solution.frames[1].suspected);
  CHECK(solution.groups == 1);
  // The same again is no other content.
  scene.links.pop_back();
  scene.links.push_back(scene.links.back());
  CHECK_FALSE(solver.solve(scene).frames[0].suspected);
}

TEST_CASE("TeamFrames: links of no members, of other epochs and implausible ones are refused") {
  TeamScene scene(306, 2);
  for (int i = 0; i < 4; ++i) scene.state(0, 1);
  for (std::uint32_t i = 0; i < 4; ++i) scene.links[i].revision = i + 1;
  TeamSolver solver;
  CHECK(solver.solve(scene).links[3].verdict == LinkVerdict::kUsed);
  scene.links[3].to_epoch = 7;
  CHECK(solver.solve(scene).links[3].verdict == LinkVerdict::kOtherEpoch);
  INFO("its revision says nothing of this epoch: the latest link of that counts");
  CHECK(solver.solve(scene).links[2].verdict == LinkVerdict::kUsed);
  scene.links[3].to_epoch = 1;
  scene.links[3].T_from_to(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK(solver.solve(scene).links[3].verdict == LinkVerdict::kInvalid);
  scene.links[3] = scene.links[2];
  scene.links[3].revision = 4;
  scene.links[3].covariance.values[0] = -1.0;
  CHECK(solver.solve(scene).links[3].verdict == LinkVerdict::kInvalid);
  INFO("what cannot be decoded states nothing: the latest link of those that can counts");
  CHECK(solver.solve(scene).links[2].verdict == LinkVerdict::kUsed);
  INFO("it is no second content, not even beside itself");
  scene.links[3].covariance.values[0] = std::numeric_limits<double>::quiet_NaN();
  for (const std::uint32_t revision : {4U, 3U}) {
    scene.links[3].revision = revision;
    scene.links.push_back(scene.links[3]);
    const TeamSolution solution = solver.solve(scene);
    CHECK(solution.links[3].verdict == LinkVerdict::kInvalid);
    CHECK(solution.links.back().verdict == LinkVerdict::kInvalid);
    CHECK(solution.links[2].verdict == LinkVerdict::kUsed);
    CHECK_FALSE(solution.frames[0].suspected);
    scene.links.pop_back();
  }
  scene.links[3].to = scene.links[3].from;
  CHECK(solver.solve(scene).links[3].verdict == LinkVerdict::kInvalid);
  scene.links[3].to = 99;
  CHECK(solver.solve(scene).links[3].verdict == LinkVerdict::kNotMember);
  CHECK(solver.solve(scene).links[2].verdict == LinkVerdict::kUsed);
}

TEST_CASE("TeamFrames: what cannot be solved is refused") {
  TeamScene scene(307, 3);
  scene.state_both(0, 1);
  const auto status = [](TeamSolver& solver, const TeamScene& of) {
    return solver.frames.solve(of.links, of.priors, of.members).status();
  };
  TeamSolver solver(3, 2);
  CHECK(status(solver, scene) == Status::kOk);
  scene.state(1, 2);
  CHECK(status(solver, scene) == Status::kResourceExhausted);
  TeamSolver few(2, 4);
  CHECK(status(few, scene) == Status::kResourceExhausted);
  TeamFrames none;
  CHECK(none.solve(scene.links, scene.priors, scene.members).status() ==
        Status::kResourceExhausted);

  TeamSolver enough(3, 3);
  scene.priors.push_back({20, Matrix34d::Identity(), true, {}});
  CHECK(status(enough, scene) == Status::kOk);
  TeamScene bad = scene;
  bad.priors.push_back(bad.priors[0]);
  CHECK(status(enough, bad) == Status::kInvalidArgument);
  bad = scene;
  bad.priors[0].T_team_robot(0, 0) = 3.0;
  CHECK(status(enough, bad) == Status::kInvalidArgument);
  bad = scene;
  bad.priors[0].T_team_robot(0, 3) = 1e6;
  CHECK(status(enough, bad) == Status::kInvalidArgument);
  bad = scene;
  bad.priors[0].exact = false;
  CHECK(status(enough, bad) == Status::kInvalidArgument);
  bad = scene;
  bad.members[2] = bad.members[0];
  CHECK(status(enough, bad) == Status::kInvalidArgument);
  bad = scene;
  bad.priors[0].robot = 99;  // of nobody here
  bad.priors[0].T_team_robot(0, 0) = 3.0;
  CHECK(status(enough, bad) == Status::kOk);

  AlignedMemory memory(TeamFrames::required_bytes(3, 3) - 1);
  Arena arena = memory.arena();
  CHECK(TeamFrames::make(arena, 3, 3).status() == Status::kResourceExhausted);
  CHECK(TeamFrames::make(arena, 0, 3).status() == Status::kInvalidArgument);
  CHECK(TeamFrames::make(arena, 65, 3).status() == Status::kInvalidArgument);
  CHECK(TeamFrames::make(arena, 64, 513).status() == Status::kInvalidArgument);
}

TEST_CASE("TeamFrames: a team of nobody, and robots without links") {
  TeamSolver solver(2, 0);
  CHECK(solver.frames.solve({}, {}, {})->frames.empty());
  const std::array<FrameMember, 2> members{{{5, 0}, {3, 0}}};
  const TeamSolution solution = *solver.frames.solve({}, {}, members);
  REQUIRE(solution.frames.size() == 2);
  CHECK(solution.frames[0].robot == 3);
  CHECK(solution.groups == 2);
  CHECK(solution.frames[1].state == FrameState::kAlone);
  CHECK(solution.frames[1].group == 5);
}

TEST_CASE("golden digest: the frames of a team are the same to the bit on every machine") {
  TeamSolver solver;
  CHECK(solver.solve(crowded_scene(308)).digest == 0x8c2f5e08527f9d57U);
}

TEST_CASE("TeamFrames: as many robots and links as there may be") {
  TeamScene scene(309, 64);
  for (std::size_t i = 0; i < 64; ++i) {
    for (std::size_t step = 1; step <= 4; ++step) scene.state_both(i, (i + step) % 64);
  }
  REQUIRE(scene.links.size() == TeamFrames::kMostLinks);
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 1);
  for (std::size_t i = 0; i < 64; ++i) {
    const Matrix34d T = scene.truth(0, i);
    CHECK(distance_between(solution.frames[i].T_team_robot, T) < 0.5);
    CHECK(angle_between(solution.frames[i].T_team_robot, T) < 0.02);
    CHECK(solution.frames[i].state == FrameState::kLinked);
  }
}

}  // namespace
}  // namespace tessera
