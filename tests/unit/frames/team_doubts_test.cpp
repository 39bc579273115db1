// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Cycles of links that do not close: what is refused, and who is named.
#include "team_scene.hpp"

namespace tessera {
namespace {

TEST_CASE("TeamFrames: two that contradict each other get no frame, and nobody is named") {
  TeamScene scene(4300, 2);
  scene.state(0, 1);
  scene.state_falsely(1, 0, {1, 0, 0});
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(solution.links[i].verdict == LinkVerdict::kContradicted);
    CHECK_FALSE(solution.links[i].compared);
    CHECK(solution.frames[i].state == FrameState::kContradicted);
    CHECK_FALSE(solution.frames[i].suspected);
  }
}

TEST_CASE("TeamFrames: far from the maps' origins, links are compared at the overlap") {
  // At the origins, 0.002 rad over a kilometre are two metres.
  const Point3d p_first{900, -400, 2};
  for (const double shift_m : {0.05, 0.5}) {
    TeamScene scene(4310, 2);
    scene.links = {scene.exactly(0, 1), scene.exactly(1, 0)};
    const Point3d p_second = apply(inverse(scene.truth(0, 1)), p_first);
    scene.links[0].covariance.about_a = p_first;
    scene.links[1].covariance.about_a = p_second;
    Matrix34d& T = scene.links[1].T_from_to;
    T = product(motion_about(p_second, {shift_m, 0, 0}, {0, 0, 0.002}), T);
    TeamSolver solver;
    const TeamSolution solution = solver.solve(scene);
    CHECK(solution.links[1].confirmed == (shift_m < 0.1));
    CHECK(solution.groups == (shift_m < 0.1 ? 1 : 2));
  }
}

TEST_CASE("TeamFrames: a third robot that both know decides who lies") {
  TeamScene scene(4301, 3);
  scene.state(0, 1);
  scene.state_falsely(1, 0, {1, 0, 0});
  scene.state_both(0, 2);
  scene.state_both(1, 2);
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.links[0].verdict == LinkVerdict::kUsed);
  CHECK(solution.links[0].confirmed);
  CHECK(solution.links[1].verdict == LinkVerdict::kAuthorRefused);
  CHECK(solution.links[1].sigmas > 10.0);
  CHECK(solution.frames[1].suspected);
  CHECK_FALSE(solution.frames[0].suspected);
  CHECK_FALSE(solution.frames[2].suspected);
  CHECK(solution.groups == 1);
}

TEST_CASE("TeamFrames: who contradicts himself is named without anybody's word about him") {
  TeamScene scene(4302, 3);
  scene.state_both(0, 1);
  scene.state_falsely(2, 0, {1, 0, 0});
  scene.state_falsely(2, 1, {-1, 3, 0});
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.frames[2].suspected);
  CHECK(solution.frames[2].state == FrameState::kContradicted);
  CHECK(solution.frames[1].group == 10);
  CHECK(solution.frames[1].state == FrameState::kLinked);
  // As a whole in another place, nothing contradicts it; it is shown as its own word.
  scene.links.resize(2);
  Matrix34d& T = scene.T_world_robot[2];
  T = product(motion_about(T.col(3), {5, 0, 0}, {0, 0, 0.2}), T);
  scene.state(2, 0);
  scene.state(2, 1);
  const TeamSolution moved = solver.solve(scene);
  CHECK_FALSE(moved.frames[2].suspected);
  CHECK(moved.frames[2].state == FrameState::kOnlyByOne);
  CHECK(moved.frames[2].joined_by == 0b100);
  CHECK(moved.frames[1].joined_by == 0);
}

TEST_CASE("TeamFrames: those whom one member joins are shown as such") {
  TeamScene scene(4303, 5);
  scene.state_both(0, 1);
  scene.state_both(3, 4);
  scene.state_both(1, 2);
  scene.state_both(2, 3);
  TeamSolver solver;
  TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 1);
  CHECK(solution.frames[1].joined_by == 0);
  CHECK(solution.frames[3].joined_by == 0b00110);
  CHECK(solution.frames[4].joined_by == 0b01110);
  CHECK(solution.frames[4].state == FrameState::kOnlyByOne);
  scene.state_both(0, 4);
  solution = solver.solve(scene);
  for (const RobotFrame& frame : solution.frames) CHECK(frame.joined_by == 0);
}

TEST_CASE("TeamFrames: a map that is bent names its robot where enough others agree") {
  // All see the fifth, and it sees them, but at one end of its map it is elsewhere.
  TeamScene scene(4304, 5);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = i + 1; j < 4; ++j) scene.state_both(i, j);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const Matrix34d straight = scene.T_world_robot[4];
    scene.T_world_robot[4] =
        product(motion_about({0, 0, 0}, {3.0 * static_cast<double>(i), 0, 0}, {0, 0, 0}), straight);
    scene.state_both(i, 4);
    scene.T_world_robot[4] = straight;
  }
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.frames[4].suspected);
  CHECK(solution.frames[4].state == FrameState::kContradicted);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK_FALSE(solution.frames[i].suspected);
    CHECK(solution.frames[i].state == FrameState::kLinked);
    CHECK(distance_between(solution.frames[i].T_team_robot, scene.truth(0, i)) < 0.1);
  }
}

TEST_CASE("TeamFrames: three whose confirmed links do not close get no frame") {
  TeamScene scene(4305, 3);
  scene.state_both(0, 1);
  scene.state_both(1, 2);
  const Matrix34d straight = scene.T_world_robot[2];
  scene.T_world_robot[2](0, 3) += 3.0;
  scene.state_both(0, 2);
  scene.T_world_robot[2] = straight;
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 3);
  for (const RobotFrame& frame : solution.frames) {
    CHECK(frame.state == FrameState::kContradicted);
    CHECK_FALSE(frame.suspected);
  }
}

TEST_CASE("TeamFrames: a ring of robots that does not close is refused where it may be wrong") {
  // Six confirmed links in a ring of which one is off, and a tail that is not part of it.
  TeamScene scene(4306, 7);
  for (std::size_t i = 0; i < 5; ++i) scene.state_both(i, i + 1);
  const Matrix34d straight = scene.T_world_robot[5];
  scene.T_world_robot[5](1, 3) += 3.0;
  scene.state_both(5, 0);
  scene.T_world_robot[5] = straight;
  scene.state_both(5, 6);
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK(solution.groups == 6);
  CHECK(solution.frames[6].state == FrameState::kLinked);
  CHECK(solution.frames[0].state == FrameState::kContradicted);
  for (const RobotFrame& frame : solution.frames) CHECK_FALSE(frame.suspected);
}

TEST_CASE("TeamFrames: a vague measurement confirms nothing") {
  // Along a corridor, one robot lies within what the other one cannot see.
  TeamScene scene(4307, 2);
  scene.state_falsely(1, 0, {8, 0, 0});
  scene.state(0, 1);
  scene.links[1].covariance = FrameCovariance::isotropic(Point3d::Zero(), 20.0, 0.01);
  TeamSolver solver;
  const TeamSolution solution = solver.solve(scene);
  CHECK_FALSE(solution.links[0].confirmed);
  CHECK(solution.frames[1].joined_by != 0);
}

}  // namespace
}  // namespace tessera
