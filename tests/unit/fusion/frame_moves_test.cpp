// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The phases of a move, and what of it is marked.
#include "tessera/fusion/internal/frame_moves.hpp"

#include <catch2/catch.hpp>
#include <optional>

#include "support/aligned_memory.hpp"

namespace tessera {
namespace {

using Phase = FrameMoves::Phase;

GridTransform shift_by(double x_m) {
  Matrix34d T = Matrix34d::Identity();
  T(0, 3) = x_m;
  return *GridTransform::make(T, 0.1);
}

struct Team {
  static constexpr ReplicasConfig kConfig{
      .segments = 64, .blocks = 64, .contributions = 4, .robot_segments = 64};
  explicit Team(bool place_robots = false)
      : memory(Replicas::required_bytes(kConfig) + FrameMoves::required_bytes(4) +
               RobotPlaces::required_bytes() + GlobalRecords::required_bytes(256)) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, kConfig);
    moves = *FrameMoves::make(arena, 4, *RobotPlaces::make(arena, 0.1, !place_robots));
    records = *GlobalRecords::make(arena, 256, 0);
    slot = *replicas.open({1, 1, 0});
    moves.open(replicas, slot, shift_by(0.0));
    REQUIRE(replicas.put(slot, *pack(BlockCoord{0, 0, 0}), 1, bytes).ok());
  }
  bool marked(std::int32_t x) { return records.find({x, 0, 0}) != 0; }

  std::array<std::byte, 8> bytes{};
  AlignedMemory memory;
  Replicas replicas;
  FrameMoves moves;
  GlobalRecords records;
  Replicas::Slot slot = 0;
};

}  // namespace

TEST_CASE("FrameMoves: only a later revision moves a contribution, also while one waits") {
  Team team;
  CHECK(team.moves.set_frame(team.replicas, team.slot, shift_by(1.6), 0) ==
        Replicas::Change::kStale);
  CHECK(team.moves.set_frame(team.replicas, team.slot, shift_by(1.6), 4) ==
        Replicas::Change::kTaken);
  CHECK(team.moves.set_frame(team.replicas, team.slot, shift_by(3.2), 4) ==
        Replicas::Change::kStale);
  CHECK(team.moves.set_frame(team.replicas, team.slot, shift_by(3.2), 5) ==
        Replicas::Change::kTaken);
  CHECK(team.moves.set_frame(team.replicas, 3, shift_by(3.2), 9) == Replicas::Change::kStale);
  CHECK(team.moves.busy());
  CHECK(team.moves.phase() == Phase::kSettled);
}

TEST_CASE(
    "FrameMoves: where blocks are and where they will be is marked before the frame is in force") {
  Team team;
  static_cast<void>(team.moves.set_frame(team.replicas, team.slot, shift_by(8.0), 1));
  team.moves.begin(team.replicas);
  CHECK(team.moves.phase() == Phase::kMarking);
  // What arrives meanwhile is of both places.
  REQUIRE(
      team.moves.mark_change(team.replicas, team.records, team.slot, *pack(BlockCoord{20, 0, 0})));
  CHECK(team.marked(20));
  CHECK(team.marked(30));
  for (int i = 0; i < 100 && team.moves.phase() == Phase::kMarking; ++i) {
    CHECK(team.replicas.contribution(team.slot).frame_revision == 0);
    team.moves.mark(team.replicas, team.records, 1);
  }
  CHECK(team.moves.phase() == Phase::kStaging);
  CHECK(team.marked(0));
  CHECK(team.marked(10));
  CHECK(team.replicas.contribution(team.slot).frame_revision == 1);
  CHECK(team.records.at(team.records.find({0, 0, 0})).part() == UpdatePart::kMove);
  // What arrives from here on does not put the end of the move off.
  const std::uint32_t moving = team.records.moving();
  REQUIRE(
      team.moves.mark_change(team.replicas, team.records, team.slot, *pack(BlockCoord{5, 0, 0})));
  CHECK(team.records.moving() == moving);

  team.moves.begin_merging();
  CHECK(team.moves.phase() == Phase::kMerging);
  team.moves.finish(team.replicas, 1);
  CHECK(team.moves.phase() == Phase::kSettled);
  CHECK_FALSE(team.moves.busy());
}

TEST_CASE("FrameMoves: a robot without a place marks nothing until it has one") {
  Team team(true);
  const auto place = [&](std::uint32_t robot, std::optional<double> x_m) {
    Matrix34d T = Matrix34d::Identity();
    T(0, 3) = x_m.value_or(0.0);
    return *team.moves.place(robot, x_m ? std::optional(T) : std::nullopt);
  };
  REQUIRE(
      team.moves.mark_change(team.replicas, team.records, team.slot, *pack(BlockCoord{3, 0, 0})));
  CHECK(team.records.size() == 0);
  // Its frame changes without a move.
  static_cast<void>(team.moves.set_frame(team.replicas, team.slot, shift_by(0.8), 1));
  team.moves.begin(team.replicas);
  CHECK_FALSE(team.moves.busy());
  CHECK(team.replicas.contribution(team.slot).frame_revision == 1);

  CHECK(place(1, 8.0) == Replicas::Change::kTaken);
  CHECK(team.moves.busy());
  team.moves.begin(team.replicas);
  CHECK(team.moves.phase() == Phase::kMarking);
  // What is opened and arrives meanwhile goes with the rest of the robot.
  const Replicas::Slot late = *team.replicas.open({1, 1, 1});
  team.moves.open(team.replicas, late, shift_by(0.0));
  CHECK(team.replicas.contribution(late).hidden);
  REQUIRE(team.moves.mark_change(team.replicas, team.records, late, *pack(BlockCoord{20, 0, 0})));
  CHECK_FALSE(team.marked(20));
  CHECK(team.marked(30));
  while (team.moves.phase() == Phase::kMarking) team.moves.mark(team.replicas, team.records, 1000);
  CHECK_FALSE(team.marked(1));
  CHECK(team.marked(11));  // both frames: 8.8 m
  CHECK_FALSE(team.replicas.contribution(late).hidden);
  CHECK(team.replicas.contribution(team.slot).T_global_local == shift_by(8.8));
  CHECK(team.replicas.contribution(team.slot).T_world_local == shift_by(0.8));
  team.moves.begin_merging();
  team.moves.finish(team.replicas, 1);
  CHECK_FALSE(team.moves.busy());

  CHECK(place(1, 8.0) == Replicas::Change::kStale);
  CHECK_FALSE(team.moves.busy());
  CHECK(place(1, std::nullopt) == Replicas::Change::kTaken);
  team.moves.begin(team.replicas);
  while (team.moves.phase() == Phase::kMarking) team.moves.mark(team.replicas, team.records, 1000);
  CHECK(team.replicas.contribution(team.slot).hidden);
  CHECK(team.moves.has_hidden());
}

TEST_CASE("FrameMoves: where robots lie as they state, one is left out and taken back") {
  Team team;
  const Matrix34d identity = Matrix34d::Identity();
  const auto hidden = [&] { return team.replicas.contribution(team.slot).hidden; };
  const auto settle = [&] {
    team.moves.begin(team.replicas);
    while (team.moves.phase() == Phase::kMarking) team.moves.mark(team.replicas, team.records, 99);
    if (team.moves.phase() == Phase::kSettled) return;
    team.moves.begin_merging();
    team.moves.finish(team.replicas, 1);
  };
  CHECK_FALSE(hidden());
  CHECK(*team.moves.place(1, identity) == Replicas::Change::kStale);
  Matrix34d elsewhere = identity;
  elsewhere(0, 3) = 1.0;
  CHECK(team.moves.place(1, elsewhere).status() == Status::kInvalidArgument);

  CHECK(*team.moves.place(1, std::nullopt) == Replicas::Change::kTaken);
  CHECK(team.moves.places().is_left_out(1));
  CHECK(team.moves.places().next_left_out(0) == 1U);
  CHECK_FALSE(team.moves.places().next_left_out(2));
  settle();
  CHECK(hidden());
  INFO("what comes later is left out from its beginning, and others are not");
  const Replicas::Slot later = *team.replicas.open({1, 1, 1});
  team.moves.open(team.replicas, later, shift_by(0.8));
  CHECK(team.replicas.contribution(later).hidden);
  const Replicas::Slot other = *team.replicas.open({2, 1, 0});
  team.moves.open(team.replicas, other, shift_by(0.8));
  CHECK_FALSE(team.replicas.contribution(other).hidden);

  CHECK(*team.moves.place(1, identity) == Replicas::Change::kTaken);
  settle();
  CHECK_FALSE(hidden());
  CHECK_FALSE(team.replicas.contribution(later).hidden);
  CHECK(team.replicas.contribution(later).T_global_local == shift_by(0.8));
  CHECK_FALSE(team.moves.places().next_left_out(0));
  CHECK_FALSE(team.moves.busy());
}

TEST_CASE("FrameMoves: what leaves keeps its slot until its replicas are dropped") {
  Team team;
  team.moves.remove(team.replicas, team.slot);
  CHECK(team.moves.leaving(team.slot));
  CHECK(team.moves.set_frame(team.replicas, team.slot, shift_by(1.6), 7) ==
        Replicas::Change::kStale);
  team.moves.begin(team.replicas);
  while (team.moves.phase() == Phase::kMarking) team.moves.mark(team.replicas, team.records, 1000);
  CHECK(team.replicas.contribution(team.slot).leaving);
  CHECK(team.replicas.contribution(team.slot).present);
  team.moves.begin_merging();
  for (int i = 0; i < 100 && team.moves.phase() == Phase::kMerging; ++i)
    team.moves.finish(team.replicas, 1);
  CHECK_FALSE(team.moves.busy());
  CHECK_FALSE(team.replicas.contribution(team.slot).present);
  CHECK_FALSE(team.moves.leaving(team.slot));
}

}  // namespace tessera
