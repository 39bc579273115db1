// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What FrameFinder refuses: no frame rather than a false one.
#include <array>
#include <limits>

#include "finder_rig.hpp"

namespace tessera {

namespace {

WorldView all_of(double length_m, double width_m, const Matrix34d& T_map_world) {
  return {{-0.5, -0.5, -0.5}, {length_m + 0.5, width_m + 0.5, 3.5}, T_map_world, 0.2, false};
}

}  // namespace

TEST_CASE("two different halls are not put together") {
  const auto a = map_of(large_hall(), left_of(30.5), room_classes());
  FinderRig rig;
  for (const double yaw_deg : {0.0, 31.0, 140.0}) {
    CAPTURE(yaw_deg);
    const auto b = map_of(other_hall(), all_of(24.0, 15.0, frame_of(yaw_deg, 2.0, 30.0, {3, 4, 1})),
                          room_classes());
    CHECK(rig.find(a->map, b->map).verdict != FrameVerdict::kFound);
  }
}

TEST_CASE("a hall that is the same when it is turned by half is ambiguous") {
  const std::vector<Solid> things{{{6.0, 4.0, 0.0}, {7.0, 9.0, 2.0}, 3},
                                  {{17.0, 7.0, 0.0}, {18.0, 12.0, 2.0}, 3},
                                  {{11.5, 7.5, 0.0}, {12.5, 8.5, 3.4}, 3}};
  const SolidWorld hall = room_of(24.0, 16.0, 4.0, things);
  const auto a =
      map_of(hall, all_of(24.0, 16.0, frame_of(0.0, 0.0, 0.0, {0, 0, 0})), room_classes());
  const auto b =
      map_of(hall, all_of(24.0, 16.0, frame_of(50.0, 1.0, 0.0, {5, 5, 0})), room_classes());
  FinderRig rig;
  const FrameAnswer answer = rig.find(a->map, b->map, FrameQuestion{});
  CHECK(answer.verdict == FrameVerdict::kAmbiguous);
  CHECK(answer.support_second > 0.8 * answer.support);
}

TEST_CASE("a passage between two walls holds nothing along it") {
  // Parts of a long passage, none of which has an end.
  SolidWorld passage = room_of(200.0, 6.0, 4.0, {});
  const auto part = [&](double from_m, const Matrix34d& T_map_world) {
    return map_of(passage,
                  {{from_m, -0.5, -0.5}, {from_m + 50.0, 6.5, 3.5}, T_map_world, 0.2, false},
                  room_classes());
  };
  const auto a = part(50.0, frame_of(0.0, 0.0, 0.0, {-50, 0, 0}));
  const auto b = part(70.0, frame_of(10.0, 0.0, 0.0, {-70, 0, 0}));
  FinderRig rig;
  CHECK(rig.find(a->map, b->map).verdict != FrameVerdict::kFound);
  // Not even where the guess is right: it may as well be another.
  FrameQuestion question;
  question.T_a_b_guess =
      product(frame_of(0.0, 0.0, 0.0, {-50, 0, 0}), inverse(frame_of(10.0, 0.0, 0.0, {-70, 0, 0})));
  question.is_guess = true;
  question.reach_m = 3.0;
  question.reach_z_m = 2.0;
  question.yaw_steps = 3;
  const FrameAnswer answer = rig.find(a->map, b->map, question);
  CHECK((answer.verdict == FrameVerdict::kLoose || answer.verdict == FrameVerdict::kAmbiguous));
}

TEST_CASE("a wall of one map in the free space of the other is a veto") {
  // The same hall, but for a wall right through it.
  const auto a = map_of(large_hall(), left_of(30.5), room_classes());
  SolidWorld walled = large_hall();
  walled.solids.push_back({{0.0, 8.0, 0.0}, {30.0, 10.0, 3.4}, 2});
  const Matrix34d T_b_world = frame_of(20.0, 0.0, 0.0, {1, 2, 0});
  const auto b = map_of(walled, all_of(30.0, 18.0, T_b_world), room_classes());
  FinderRig rig;
  CHECK(rig.find(a->map, b->map).verdict != FrameVerdict::kFound);
  FrameQuestion question;
  question.T_a_b_guess = inverse(T_b_world);
  question.is_guess = true;
  question.reach_m = 2.0;
  question.yaw_steps = 1;
  const FrameAnswer there = rig.find(a->map, b->map, question);
  CHECK(there.verdict != FrameVerdict::kFound);
  CHECK(there.agreement_guess.contradicted > 1'000);
}

TEST_CASE("maps with nothing in them, or nothing that stands, are told as such") {
  const auto hall = map_of(large_hall(), left_of(30.5), room_classes());
  const SmallMap empty(config_of_pages(16));
  SolidWorld floor;
  floor.solids.push_back({{-30.0, -30.0, -1.0}, {30.0, 30.0, 0.0}, 1});
  const auto field = map_of(
      floor, {{-20, -20, -0.5}, {20, 20, 1.5}, Matrix34d::Identity(), 0.2, false}, room_classes());
  FinderRig rig;
  for (const LocalMap* const little : std::array<const LocalMap*, 2>{&empty.map, &field->map}) {
    CHECK(rig.find(hall->map, *little).verdict == FrameVerdict::kTooLittle);
    CHECK(rig.find(*little, hall->map).verdict == FrameVerdict::kTooLittle);
    CHECK(rig.find(*little, *little).verdict == FrameVerdict::kTooLittle);
  }
}

TEST_CASE("questions that are none are refused, and the search goes on") {
  const auto hall = map_of(large_hall(), left_of(22.0), room_classes());
  FinderRig rig;
  REQUIRE(rig.finder.begin(hall->map, hall->map, FinderRig::nearby()) == Status::kOk);
  const std::uint32_t steps = rig.finder.steps();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  FrameQuestion question;
  question.T_a_b_guess(0, 3) = nan;
  CHECK(rig.finder.begin(hall->map, hall->map, question) == Status::kInvalidArgument);
  question = {};
  question.T_a_b_guess(0, 0) = 2.0;
  CHECK(rig.finder.begin(hall->map, hall->map, question) == Status::kInvalidArgument);
  for (const double reach_m : {nan, -1.0, 1e9}) {
    question = {};
    question.reach_m = reach_m;
    CHECK(rig.finder.begin(hall->map, hall->map, question) == Status::kInvalidArgument);
    question = {};
    question.reach_z_m = reach_m;
    CHECK(rig.finder.begin(hall->map, hall->map, question) == Status::kInvalidArgument);
  }
  question = {};
  question.yaw_steps = -1;
  CHECK(rig.finder.begin(hall->map, hall->map, question) == Status::kInvalidArgument);
  question = {};
  question.is_refinement = true;
  CHECK(rig.finder.begin(hall->map, hall->map, question) == Status::kInvalidArgument);
  CHECK(rig.finder.steps() == steps);
  while (!rig.finder.step()) continue;
  CHECK(rig.finder.answer().verdict == FrameVerdict::kFound);
  AlignedMemory small(FrameFinder::required_bytes() - 64);
  Arena arena = small.arena();
  CHECK(FrameFinder::make(arena).status() == Status::kResourceExhausted);
}

}  // namespace tessera
