// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The team clears together: what one robot has and another one sees through later is gone for all,
// whatever their clocks say; and one that lies makes no hole.
#include <catch2/catch.hpp>

#include "watchers.hpp"

namespace tessera {

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
  // Robot 2 lies, again and again; the others look on, or do not.
  const bool look_on = GENERATE(true, false);
  for (int round = 0; round < 20; ++round) {
    team.lie(2);
    if (look_on) {
      static_cast<void>(team.scan(0, true));
      static_cast<void>(team.scan(1, true));
    }
    team.talk(10);
    for (int i = 0; i < 3; ++i) REQUIRE(team.box_voxels(i) == box);
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

TEST_CASE("team clears: scans that may have been taken before a block was heard do not count") {
  Watchers team(2);
  for (int i = 0; i < 4; ++i) team.scan(0, true);
  team.talk(60);
  REQUIRE(team.box_voxels(1) > 10);
  // The first asks; the others are of the same moment.
  team.scan_and_talk(1, false, 1);
  for (int i = 0; i < 30; ++i) team.scan(1, false);
  team.talk(60);
  REQUIRE(team.robot(1).sharer().objections().watched_blocks > 0);
  CHECK(team.robot(1).sharer().objections().objected_voxels == 0);
  CHECK(team.box_voxels(1) > 10);
}

TEST_CASE(
    "team clears: a clock that is set back clears nothing that is there, and later the rest") {
  Watchers team(2);
  for (int i = 0; i < 4; ++i) team.scan(0, true);
  team.talk(60);
  team.scan_and_talk(1, false, 2);
  team.set_back(1, 600'000'000);
  for (int i = 0; i < 10; ++i) team.scan(1, false);
  team.talk(1);
  CHECK(team.robot(1).sharer().objections().objected_voxels == 0);
  CHECK(team.box_voxels(0) > 10);
  // Once what was watched before is asked about anew.
  team.talk(220);
  team.scan_and_talk(1, false, 30);
  CHECK(team.robot(1).sharer().objections().objected_voxels > 10);
  CHECK(team.box_voxels(1) == 0);
}

TEST_CASE("team clears: a robot that makes no objections hears those of others") {
  Watchers team(2, true, false);
  for (int i = 0; i < 4; ++i) team.scan(0, true);
  team.talk(60);
  REQUIRE(team.box_voxels(0) > 10);
  team.scan_and_talk(1, false, 30);
  team.talk(60);
  CHECK(team.box_voxels(0) == 0);
  CHECK(team.robot(0).sharer().objections().watched_blocks == 0);
  CHECK(team.agree());
}

}  // namespace tessera
