// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which frame a group has, when groups meet and when robots leave.
#include "team_scene.hpp"

namespace tessera {
namespace {

/// Robots 10 and 20 are linked, and 30 and 40 are.
TeamScene two_pairs(std::uint64_t seed) {
  TeamScene scene(seed, 4);
  scene.state_both(0, 1);
  scene.state_both(2, 3);
  return scene;
}

void check_near(const RobotFrame& frame, const Matrix34d& T, double within_m = 0.3) {
  CAPTURE(frame.robot);
  CHECK(distance_between(frame.T_team_robot, T) < within_m);
  CHECK(angle_between(frame.T_team_robot, T) < 0.02);
}

TEST_CASE("TeamFrames: where groups meet, the frame of the lowest robot survives") {
  TeamScene scene = two_pairs(311);
  TeamSolver solver;
  TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 2);
  CHECK(solution.frames[2].group == 30);
  CHECK(solution.frames[2].T_team_robot == Matrix34d::Identity());
  check_near(solution.frames[3], scene.truth(2, 3));
  const Matrix34d before = solution.frames[1].T_team_robot;

  scene.state_both(1, 2);
  solution = solver.solve(scene);
  CHECK(solution.groups == 1);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(solution.frames[i].group == 10);
    CHECK(solution.frames[i].anchor == 10);
    CHECK(solution.frames[i].anchored_by == FrameAnchor::kLowestRobot);
    check_near(solution.frames[i], scene.truth(0, i));
  }
  // Those that keep their frame do not move at all, but for rounding.
  CHECK(solution.frames[0].T_team_robot == Matrix34d::Identity());
  CHECK((solution.frames[1].T_team_robot - before).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("TeamFrames: an exact prior's frame survives a meeting, then a vague one's") {
  TeamScene scene = two_pairs(312);
  scene.state_both(1, 2);
  const Matrix34d& vague = scene.T_world_robot[1];
  scene.priors.push_back({20, vague, false, FrameCovariance::isotropic(vague.col(3), 0.1, 0.01)});
  TeamSolver solver;
  TeamSolution solution = solver.solve(scene);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(solution.frames[i].anchor == 20);
    CHECK(solution.frames[i].anchored_by == FrameAnchor::kVaguePrior);
    check_near(solution.frames[i], scene.T_world_robot[i]);
  }
  // With nothing else that knows it, a vague prior is where its robot is.
  CHECK((solution.frames[1].T_team_robot - vague).cwiseAbs().maxCoeff() < 1e-8);
  CHECK(solution.frames[1].covariance.sigma_m() == Approx(0.1 * std::sqrt(3.0)).epsilon(0.02));

  const Matrix34d given =
      product(motion_about({0, 0, 0}, {0.02, 0, 0}, {0, 0, 0}), scene.T_world_robot[3]);
  scene.priors.push_back({40, given, true, {}});
  solution = solver.solve(scene);
  CHECK(solution.frames[3].T_team_robot == given);
  CHECK(solution.frames[3].state == FrameState::kGiven);
  CHECK(solution.frames[3].covariance.sigma_m() == 0.0);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(solution.frames[i].anchor == 40);
    CHECK(solution.frames[i].anchored_by == FrameAnchor::kExactPrior);
    check_near(solution.frames[i], scene.T_world_robot[i]);
  }
}

TEST_CASE("TeamFrames: all frames that are given exactly hold to the bit, and are one group") {
  TeamScene scene = two_pairs(313);
  scene.priors.push_back({10, scene.T_world_robot[0], true, {}});
  scene.priors.push_back({40, scene.T_world_robot[3], true, {}});
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 1);
  CHECK(solution.frames[0].T_team_robot == scene.T_world_robot[0]);
  CHECK(solution.frames[3].T_team_robot == scene.T_world_robot[3]);
  check_near(solution.frames[1], scene.T_world_robot[1]);
  check_near(solution.frames[2], scene.T_world_robot[2]);
}

TEST_CASE("TeamFrames: links that contradict exact priors are refused, and the priors hold") {
  TeamScene scene(314, 3);
  scene.state_both(0, 1);
  scene.state_both(1, 2);
  Matrix34d wrong = scene.T_world_robot[1];
  wrong(0, 3) += 2.0;
  scene.priors.push_back({10, scene.T_world_robot[0], true, {}});
  scene.priors.push_back({20, wrong, true, {}});
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.links[0].verdict == LinkVerdict::kAgainstPriors);
  CHECK(solution.links[1].verdict == LinkVerdict::kAgainstPriors);
  CHECK(solution.links[0].sigmas > 10.0);
  CHECK(solution.links[2].verdict == LinkVerdict::kUsed);
  CHECK(solution.frames[1].T_team_robot == wrong);
  check_near(solution.frames[2], product(wrong, scene.truth(1, 2)));
  for (const RobotFrame& frame : solution.frames) CHECK_FALSE(frame.suspected);
}

TEST_CASE("TeamFrames: two vague priors share by their covariances what links do not know") {
  TeamScene scene(315, 2);
  scene.links.push_back(scene.exactly(0, 1));
  scene.links.push_back(scene.exactly(1, 0));
  for (std::size_t i = 0; i < 2; ++i) {
    Matrix34d T = scene.T_world_robot[i];
    T(0, 3) += i == 0 ? 0.3 : -0.1;
    scene.priors.push_back({scene.members[i].robot, T, false,
                            FrameCovariance::isotropic(T.col(3), i == 0 ? 0.3 : 0.1, 1.0)});
  }
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  // One part of 0.3 and nine of -0.1, but for the turn that two places allow.
  const Point3d middle =
      0.5 * (solution.frames[0].T_team_robot.col(3) - scene.T_world_robot[0].col(3) +
             solution.frames[1].T_team_robot.col(3) - scene.T_world_robot[1].col(3));
  CHECK(std::abs(middle.x() + 0.06) < 0.06);
  CHECK(solution.frames[0].covariance.sigma_m() < 0.3 * std::sqrt(3.0));
}

TEST_CASE("TeamFrames: priors of places without headings find the headings from links") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    TeamScene scene(3160 + seed, 4);
    for (std::size_t i = 1; i < 4; ++i) scene.state_both(0, i);
    for (std::size_t i = 0; i < 4; ++i) {
      // Any heading, and a covariance that says so.
      Matrix34d T =
          product(transform_of({0.0, 0.0, 0.0, 1.0}, Point3d::Zero()),
                  motion_about({0, 0, 0}, {0, 0, 0}, {0, 0, scene.random.uniform(-9, 9)}));
      for (int row = 0; row < 3; ++row)
        T(row, 3) = scene.T_world_robot[i](row, 3) + 0.05 * normal(scene.random);
      FramePrior prior{scene.members[i].robot, T, false,
                       FrameCovariance::isotropic(T.col(3), 0.05, 0.05)};
      prior.covariance.values[FrameCovariance::index(5, 5)] = 10.0;
      scene.priors.push_back(prior);
    }
    TeamSolver solver;
    const TeamSolution solution = solver.solve(scene);
    CHECK(solution.groups == 1);
    for (std::size_t i = 0; i < 4; ++i) {
      CHECK(distance_between(solution.frames[i].T_team_robot, scene.T_world_robot[i]) < 0.5);
      CHECK(angle_between(solution.frames[i].T_team_robot, scene.T_world_robot[i]) < 0.06);
    }
  }
}

TEST_CASE("TeamFrames: a vague prior alone places its robot, and joins it to nobody") {
  TeamScene scene(317, 2);
  for (std::size_t i = 0; i < 2; ++i)
    scene.priors.push_back({scene.members[i].robot, scene.T_world_robot[i], false,
                            FrameCovariance::isotropic(Point3d::Zero(), 5.0, 0.3)});
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 2);
  CHECK(solution.frames[1].state == FrameState::kPlaced);
  check_near(solution.frames[1], scene.T_world_robot[1], 1e-9);
}

TEST_CASE("TeamFrames: when a robot leaves, the part with the anchor keeps its frame") {
  // 10 - 20 - 30 - 40
  TeamScene scene = two_pairs(318);
  scene.state_both(1, 2);
  TeamSolver solver;
  TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 1);
  const Matrix34d before = solution.frames[1].T_team_robot;
  CHECK(solution.frames[3].joined_by == 0b0110);
  CHECK(solution.frames[3].state == FrameState::kOnlyByOne);

  // The last one of the chain leaves: nobody else moves.
  TeamScene without_40 = scene;
  without_40.members.pop_back();
  solution = solver.solve(without_40);
  CHECK((solution.frames[1].T_team_robot - before).cwiseAbs().maxCoeff() < 1e-9);

  // The one between leaves: the others keep 10's frame or take that of their own lowest robot.
  TeamScene without_20 = scene;
  without_20.members.erase(without_20.members.begin() + 1);
  solution = solver.solve(without_20);
  CHECK(solution.groups == 2);
  CHECK(solution.frames[0].state == FrameState::kAlone);
  CHECK(solution.frames[1].anchor == 30);
  CHECK(solution.frames[1].T_team_robot == Matrix34d::Identity());
  check_near(solution.frames[2], scene.truth(2, 3));

  // The anchor leaves: the frame is that of the next one.
  TeamScene without_10 = scene;
  without_10.members.erase(without_10.members.begin());
  solution = solver.solve(without_10);
  CHECK(solution.groups == 1);
  CHECK(solution.frames[0].anchor == 20);
  check_near(solution.frames[2], scene.truth(1, 3));
}

TEST_CASE("TeamFrames: covariances grow along a chain, and a second way makes them smaller") {
  TeamScene scene = two_pairs(319);
  scene.state_both(1, 2);
  TeamSolver solver;
  TeamSolution solution = solver.solve(scene);
  CHECK(solution.frames[0].covariance.sigma_m() == 0.0);
  const auto turn = [&](std::size_t i) { return solution.frames[i].covariance.sigma_rad(); };
  CHECK(turn(1) > 0.0);
  CHECK(turn(2) > turn(1));
  CHECK(turn(3) > turn(2));
  const double alone = turn(3);
  scene.state_both(0, 3);
  solution = solver.solve(scene);
  CHECK(turn(3) < 0.8 * alone);
  CHECK(solution.frames[3].joined_by == 0);
}

}  // namespace
}  // namespace tessera
