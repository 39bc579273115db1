// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What FrameFinder finds.
#include "finder_rig.hpp"

namespace tessera {

TEST_CASE("two parts of a hall are put together, whatever the frame of one") {
  const SolidWorld hall = large_hall();
  const auto a = map_of(hall, left_of(22.0), room_classes());
  FinderRig rig;
  struct Frame {
    double yaw_deg, tilt_deg, axis_deg;
    Point3d shift_m;
  };
  const std::vector<Frame> frames{{0.0, 0.0, 0.0, {0.0, 0.0, 0.0}},
                                  {90.0, 0.0, 0.0, {12.0, -7.0, 1.0}},
                                  {37.0, 3.0, 50.0, {-8.0, 9.0, -2.3}},
                                  {-158.0, 5.0, -120.0, {49.0, -49.0, 4.9}}};
  for (const Frame& frame : frames) {
    CAPTURE(frame.yaw_deg, frame.tilt_deg);
    const Matrix34d T_b_world =
        frame_of(frame.yaw_deg, frame.tilt_deg, frame.axis_deg, frame.shift_m);
    const auto b = map_of(hall, right_of(8.0, T_b_world), room_classes());
    const bool is_far = norm(frame.shift_m) > 16.0;
    const FrameAnswer answer =
        rig.find(a->map, b->map, is_far ? FrameQuestion{} : FinderRig::nearby());
    REQUIRE(answer.verdict == FrameVerdict::kFound);
    const FrameError error = error_of(answer, inverse(T_b_world));
    CHECK(error.shift_m < 0.1);
    CHECK(error.turn_deg < 0.3);
    CHECK(answer.agreement.share() > 0.95);
    CHECK(answer.worst_sigma_m < 0.1);
    // The labels are those of the same things.
    CHECK(answer.agreement.same_label > 9 * answer.agreement.labelled / 10);
  }
}

TEST_CASE("the answer is the same whatever the order in which voxels came, bit by bit") {
  const SolidWorld hall = large_hall();
  const Matrix34d T_b_world = frame_of(70.0, 2.0, 10.0, {5.0, 3.0, 0.5});
  WorldView left = left_of(22.0);
  WorldView right = right_of(8.0, T_b_world);
  const auto a = map_of(hall, left, room_classes());
  const auto b = map_of(hall, right, room_classes());
  left.backwards = right.backwards = true;
  const auto a_backwards = map_of(hall, left, room_classes());
  const auto b_backwards = map_of(hall, right, room_classes());
  FinderRig rig;
  const FrameAnswer one = rig.find(a->map, b->map);
  const FrameAnswer other = FinderRig().find(a_backwards->map, b_backwards->map);
  CHECK(one.T_a_b == other.T_a_b);
  CHECK(one.covariance == other.covariance);
  CHECK(one.support == other.support);
  // And of a finder that was used before.
  (void)rig.find(b->map, a->map);
  CHECK(rig.find(a->map, b->map).T_a_b == one.T_a_b);
}

TEST_CASE("what may move does not speak") {
  // The things of b stand elsewhere: as walls they contradict, as what moves they say nothing.
  SolidWorld moved = large_hall();
  for (std::size_t i = 0; i < 7; ++i) {
    Solid& thing = moved.solids[i];
    thing.low += Point3d{1.5, -1.0, 0.0};
    thing.high += Point3d{1.5, -1.0, 0.0};
  }
  // What tells the hall's ends apart.
  const Solid niche{{0.0, 2.0, 0.0}, {2.5, 6.0, 3.0}, 2};
  const Solid stage{{24.0, 10.0, 0.0}, {30.0, 18.0, 1.4}, 2};
  SolidWorld hall = large_hall();
  for (SolidWorld* const world : {&hall, &moved}) {
    world->solids.push_back(niche);
    world->solids.push_back(stage);
  }
  const Matrix34d T_b_world = frame_of(-20.0, 1.0, 0.0, {4.0, 9.0, 0.2});
  const WorldView all{{-0.5, -0.5, -0.5}, {30.5, 18.5, 3.5}, T_b_world, 0.2, false};
  FrameQuestion question;
  question.T_a_b_guess = inverse(T_b_world);
  question.is_guess = true;
  question.reach_m = 5.0;
  FinderRig rig;
  const auto search = [&](bool things_move) {
    const auto a = map_of(hall, left_of(30.5), room_classes(things_move));
    const auto b = map_of(moved, all, room_classes(things_move));
    return rig.find(a->map, b->map, question);
  };
  CHECK(search(false).agreement_guess.contradicted > 1'000);
  const FrameAnswer moving = search(true);
  CHECK(moving.agreement_guess.contradicted < 100);
  REQUIRE(moving.verdict == FrameVerdict::kFound);
  const FrameError error = error_of(moving, inverse(T_b_world));
  CHECK(error.shift_m < 0.1);
  CHECK(error.turn_deg < 0.3);
}

TEST_CASE("a guess narrows the search") {
  const SolidWorld hall = large_hall();
  const Matrix34d T_b_world = frame_of(25.0, 1.0, 0.0, {100.0, -300.0, 20.0});
  const auto a = map_of(hall, left_of(22.0), room_classes());
  const auto b = map_of(hall, right_of(8.0, T_b_world), room_classes());
  const Matrix34d truth = inverse(T_b_world);
  FinderRig rig;
  // Far beyond the reach, and not found by chance.
  CHECK(rig.find(a->map, b->map).verdict != FrameVerdict::kFound);
  FrameQuestion question;
  question.is_guess = true;
  question.reach_m = 5.0;
  question.reach_z_m = 2.0;
  question.yaw_steps = 5;
  // Off by four degrees and a metre on each axis, in the middle of the hall.
  const Point3d middle{15.0, 9.0, 1.0};
  const Matrix34d turn = frame_of(4.0, 0.0, 0.0, {0.0, 0.0, 0.0});
  question.T_a_b_guess = product(turn, truth);
  const Point3d shift = middle + Point3d{1.0, 1.0, 1.0} - apply(turn, middle);
  for (int i = 0; i < 3; ++i) question.T_a_b_guess(i, 3) += shift(i);
  const FrameAnswer answer = rig.find(a->map, b->map, question);
  REQUIRE(answer.verdict == FrameVerdict::kFound);
  CHECK(error_of(answer, truth).shift_m < 0.1);
  const std::uint32_t steps = rig.finder.steps();
  question.yaw_steps = 90;
  CHECK(rig.find(a->map, b->map, question).verdict == FrameVerdict::kFound);
  CHECK(rig.finder.steps() > steps + 150);
  // How well it fitted before is told beside.
  CHECK(answer.agreement_guess.share() < answer.agreement.share());
}

TEST_CASE("maps of different resolutions fit") {
  const SolidWorld hall = large_hall();
  const Matrix34d T_b_world = frame_of(61.0, 2.0, 80.0, {7.0, 3.0, -1.0});
  const auto a = map_of(hall, left_of(22.0), room_classes());
  WorldView fine = right_of(8.0, T_b_world);
  fine.resolution_m = 0.25;
  const auto b = map_of(hall, fine, room_classes());
  const FrameAnswer answer = FinderRig().find(a->map, b->map);
  REQUIRE(answer.verdict == FrameVerdict::kFound);
  CHECK(error_of(answer, inverse(T_b_world)).shift_m < 0.15);
}

}  // namespace tessera
