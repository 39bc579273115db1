// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots that load a map of an earlier day and share it: it counts once, follows restarts, and can
// be removed.
#include <catch2/catch.hpp>

#include "session_team.hpp"
#include "support/small_map.hpp"

namespace tessera {
namespace {

using State = MapSessions::State;

TEST_CASE("Session: three robots that load one file have the map of a team in which one did") {
  const bool signs = GENERATE(false, true);
  const Yesterday yesterday(4);
  std::vector<std::uint64_t> digests;
  for (const std::vector<std::uint32_t>& loaders :
       std::vector<std::vector<std::uint32_t>>{{}, {1}, {3}, {3, 1, 2}}) {
    TeamOfMembers team(signs);
    for (const std::uint32_t number : {1U, 2U, 3U}) team.start(session_config(number));
    for (const std::uint32_t number : loaders) load(team[number].sessions(), yesterday);
    team.settle();
    digests.push_back(team.digest());
    for (const std::uint32_t number : loaders) {
      const std::vector<ContributionState> held = team.held(number == 2 ? 1 : 2, number);
      REQUIRE(held.size() == 1);
      CHECK(held.front().session == yesterday.session);
      CHECK(held.front().complete);
    }
  }
  CHECK(digests[1] == digests[2]);
  CHECK(digests[1] == digests[3]);
  CHECK(digests[0] != digests[1]);
}

/// Segments that sessions take in a robot's replicas, and their records.
std::pair<std::uint32_t, std::uint32_t> segments_of_sessions(const Robot& robot) {
  std::pair<std::uint32_t, std::uint32_t> sum;
  const Replicas& replicas = robot.global().replicas();
  for (const Replicas::Slot slot : replicas.in_order()) {
    const Replicas::Contribution& one = replicas.contribution(slot);
    if (!MapSession::is(one.id.submap)) continue;
    sum.first += one.segments;
    sum.second += one.blocks;
  }
  return sum;
}

TEST_CASE("Session: one that is removed counts no more anywhere, and its memory is free") {
  const bool signs = GENERATE(false, true);
  const Yesterday yesterday(4);
  const Yesterday other(8);
  TeamOfMembers team(signs);
  for (const std::uint32_t number : {1U, 2U}) team.start(session_config(number));
  team.settle();
  const std::uint64_t without = team.digest();
  MapSessions& sessions = team[1].sessions();
  const std::uint32_t number = load(sessions, yesterday);
  load(sessions, other);
  team.settle();
  const std::uint64_t with_both = team.digest();
  CHECK(with_both != without);
  CHECK(sessions.all().size() == 2);
  CHECK(sessions.all().front().state == State::kShared);
  CHECK(sessions.all().front().blocks == yesterday.map().block_count());
  REQUIRE(sessions.remove(number) == Status::kOk);
  CHECK(sessions.remove(number) == Status::kInvalidArgument);
  CHECK(sessions.remove(77) == Status::kInvalidArgument);
  CHECK(sessions.is_withdrawing());
  CHECK_FALSE(team[1].robot().idle());
  team.settle();
  CHECK(sessions.all().size() == 1);
  // It may be loaded anew, under another number.
  const std::uint32_t again = load(sessions, yesterday);
  CHECK(again != number);
  team.settle();
  CHECK(team.digest() == with_both);
  REQUIRE(sessions.remove(again) == Status::kOk);
  REQUIRE(sessions.remove(sessions.all().front().submap) == Status::kOk);
  team.settle();
  CHECK(sessions.all().empty());
  CHECK(team.digest() == without);
  // What is left are records, and in a fleet that signs what proves them.
  for (const std::size_t holder : {1U, 2U}) {
    const auto [segments, records] = segments_of_sessions(team[holder].robot());
    CHECK(records > 0);
    CHECK(segments <= (signs ? 2 * records : 0));
  }
}

TEST_CASE("Session: a start that loads it again takes over, and nobody misses or doubles it") {
  const bool signs = GENERATE(false, true);
  const Yesterday yesterday(4);
  TeamOfMembers team(signs);
  for (const std::uint32_t number : {1U, 2U}) team.start(session_config(number));
  load(team[1].sessions(), yesterday);
  team.settle();
  const std::uint64_t with_session = team.digest();
  RobotConfig again = session_config(1, 2);
  again.keep_sessions = true;
  team.start(again);
  team.settle();
  // Others still have that of the epoch before, and give it back.
  CHECK(team.held(2, 1).size() == 1);
  CHECK(team.digest() == with_session);
  load(team[1].sessions(), yesterday);
  team.settle();
  CHECK(team.held(2, 1).size() == 2);
  CHECK(team.digest() == with_session);
  team[1].sessions().end_earlier();
  team.settle();
  const std::vector<ContributionState> held = team.held(2, 1);
  REQUIRE(held.size() == 1);
  CHECK(held.front().id.epoch == 2);
  CHECK(team.digest() == with_session);
}

TEST_CASE("Session: a start without it ends that of the epochs before, though these are kept") {
  const bool signs = GENERATE(false, true);
  const Yesterday yesterday(4);
  TeamOfMembers team(signs);
  for (const std::uint32_t number : {1U, 2U}) team.start(session_config(number));
  team.settle();
  const std::uint64_t without = team.digest();
  load(team[1].sessions(), yesterday);
  team.settle();
  CHECK(team.digest() != without);
  team.start(session_config(1, 2));
  team.run(300);  // without signatures a floor comes with the eighth announcement
  team.settle();
  CHECK(team.held(1, 1).empty());
  CHECK(team.held(2, 1).empty());
  CHECK(team.digest() == without);
  // A robot that starts later hears nothing of it either.
  team.start(session_config(3));
  team.settle();
  CHECK(team.held(3, 1).empty());
}

TEST_CASE("Session: where its robot leaves the epoch, it is loaded again") {
  const Yesterday yesterday(4);
  TeamOfMembers team(true);
  RobotConfig keeps = session_config(1);
  keeps.keep_sessions = GENERATE(false, true);
  team.start(keeps);
  team.start(session_config(2));
  load(team[1].sessions(), yesterday);
  team.settle();
  const std::uint64_t with_session = team.digest();
  REQUIRE(team[1].robot().sharer().reopen(5, 1) == Status::kOk);
  CHECK(team[1].sessions().all().empty());
  team.run(300);
  team.settle();
  CHECK(team.held(2, 1).size() == (keeps.keep_sessions ? 1 : 0));
  CHECK((team.digest() == with_session) == keeps.keep_sessions);
  load(team[1].sessions(), yesterday);
  team[1].sessions().end_earlier();
  team.settle();
  CHECK(team.held(2, 1).size() == 1);
  CHECK(team.digest() == with_session);
}

TEST_CASE(
    "Session: a robot that is excluded takes its sessions with it, and the next one's counts") {
  Yesterday yesterday(4);
  TeamOfMembers team(true);
  for (const std::uint32_t number : {1U, 2U, 3U}) team.start(session_config(number));
  load(team[2].sessions(), yesterday);
  team.settle();
  // Robot 1 says that it has it too, and has it with a weight that is next to nothing.
  yesterday.session.weight = 1;
  load(team[1].sessions(), yesterday);
  team.settle();
  const std::uint64_t claimed = team.digest();
  for (const std::size_t number : {2U, 3U})
    REQUIRE(team[number].robot().exchange().exclude(1) == Status::kOk);
  team[2].robot().finish();
  team[3].robot().finish();
  CHECK(team.held(2, 1).empty());
  CHECK(digest_of(team[2].robot().global().map()) != claimed);
  CHECK(digest_of(team[2].robot().global().map()) == digest_of(team[3].robot().global().map()));
}

TEST_CASE("Session: what cannot be one is refused, and nothing is published of it") {
  const Yesterday yesterday(4);
  Member one(session_config(1), false);
  MapSessions& sessions = one.sessions();
  const auto open = [&](const LocalMap& map, const MapSession& session,
                        const Matrix34d& T = Matrix34d::Identity()) {
    return sessions.open(map, session, T).status();
  };
  MapSession session = yesterday.session;
  session.weight = 0;
  CHECK(open(yesterday.map(), session) == Status::kInvalidArgument);
  session.weight = MapSession::kFullWeight + 1;
  CHECK(open(yesterday.map(), session) == Status::kInvalidArgument);
  session.weight = MapSession::kFullWeight;
  CHECK(open(yesterday.map(), session, shift_of(1e9, 0.0)) == Status::kInvalidArgument);
  RobotConfig coarse = small_robot_config(9);
  coarse.map.resolution_m = coarse.exchange.resolution_m = coarse.global.map.resolution_m = 0.4;
  CHECK(open(Yesterday(4, coarse).map(), session) == Status::kMismatch);
  RobotConfig heavy = small_robot_config(9);
  heavy.map.free_weight = 0.5F;
  CHECK(open(Yesterday(4, heavy).map(), session) == Status::kMismatch);
  const SmallMap other_classes(small_robot_config(9).map, 3);
  CHECK(open(other_classes.map, session) == Status::kMismatch);
  CHECK(sessions.all().empty());
  CHECK(one.robot().exchange().report().contributions == 1);
  CHECK(sessions.publish(MapSession::kFirst, yesterday.map(), yesterday.blocks, 0, 1).status() ==
        Status::kInvalidArgument);

  // Each name once, so many at a time, and so many in an epoch.
  for (std::uint64_t i = 0; i < MapSessions::kMost; ++i) {
    session.digest = i;
    REQUIRE(open(yesterday.map(), session) == Status::kOk);
    CHECK(open(yesterday.map(), session) == Status::kInvalidArgument);
  }
  session.digest = 99;
  CHECK(open(yesterday.map(), session) == Status::kResourceExhausted);
  std::int64_t now_us = 0;
  for (std::uint32_t i = 0; i < MapSessions::kMost; ++i) {
    REQUIRE(sessions.remove(sessions.all().front().submap) == Status::kOk);
    static_cast<void>(one.robot().tick(now_us += kTick_us));
    session.digest = 100U + i;
    REQUIRE(open(yesterday.map(), session) == Status::kOk);
  }
  REQUIRE(sessions.remove(sessions.all().front().submap) == Status::kOk);
  static_cast<void>(one.robot().tick(now_us += kTick_us));
  session.digest = 999;
  CHECK(open(yesterday.map(), session) == Status::kResourceExhausted);
}

TEST_CASE("Session: a robot that does not know its own frame exactly shares none") {
  const Yesterday yesterday(4);
  const auto open = [&](const FramesConfig& frames) {
    RobotConfig config = session_config(1);
    config.frames = frames;
    Member one(config, false);
    return one.sessions().open(yesterday.map(), yesterday.session, Matrix34d::Identity()).status();
  };
  CHECK(open({.mode = FrameMode::kGiven}) == Status::kOk);
  CHECK(open({.mode = FrameMode::kRefined, .sigma_m = 0.0, .sigma_rad = 0.0}) == Status::kOk);
  CHECK(open({.mode = FrameMode::kRefined}) == Status::kUnsupported);
  CHECK(open({.mode = FrameMode::kFound}) == Status::kUnsupported);
}

TEST_CASE("Session: blocks without room are counted, and the robot's own map is not harmed") {
  const Yesterday yesterday(4);
  RobotConfig config = session_config(1);
  config.global.replicas.robot_segments = 900;
  Member one(config, false);
  one.robot().integrate(StreetPart(1).view(), 0);
  std::int64_t now_us = 0;
  REQUIRE(settle(one.robot(), now_us) <= 1000);
  const std::uint64_t before = one.robot().exchange().report().published_parts;
  load(one.sessions(), yesterday);
  const MapSessions::Session& session = one.sessions().all().front();
  CHECK(session.refused_blocks > 0);
  CHECK(session.blocks > 0);
  CHECK(session.blocks + session.refused_blocks == yesterday.map().block_count());
  CHECK(one.sessions().refused_blocks() == session.refused_blocks);
  CHECK(one.robot().exchange().report().published_parts - before == session.blocks);
  CHECK(session.state == State::kShared);
}

}  // namespace
}  // namespace tessera
