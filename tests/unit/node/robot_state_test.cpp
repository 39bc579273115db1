// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/robot_state.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <limits>

#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

constexpr std::uint32_t kMost32 = std::numeric_limits<std::uint32_t>::max();

RobotState state_of(const test::TemporaryFolder& folder, std::uint32_t robot = 3) {
  Outcome<RobotState> state = RobotState::open(folder.path().string(), robot);
  INFO(state.failure().text());
  REQUIRE(state.ok());
  return std::move(*state);
}

RobotState begun(const test::TemporaryFolder& folder, EarlierEpochs earlier) {
  RobotState state = state_of(folder);
  REQUIRE(state.begin(earlier).ok());
  return state;
}

TEST_CASE("lock_robot: a robot is one process at a time") {
  const test::TemporaryFolder folder;
  const std::string state = folder.path().string();
  {
    const Outcome<FileDescriptor> lock = lock_robot(state, 3);
    REQUIRE(lock.ok());
    const Outcome<FileDescriptor> second = lock_robot(state, 3);
    REQUIRE_FALSE(second.ok());
    CHECK(second.failure().text().find("robot 3 is already running") != std::string::npos);
    CHECK(lock_robot(state, 4).ok());
  }
  CHECK(lock_robot(state, 3).ok());
}

TEST_CASE("RobotState: each start is one more than the last, of each robot by itself") {
  const test::TemporaryFolder folder;
  for (std::uint32_t start = 1; start <= 3; ++start) {
    RobotState state = state_of(folder);
    CHECK(state.starts() == start - 1);
    REQUIRE(state.begin(EarlierEpochs::kKeep).ok());
    CHECK(state.starts() == start);
    CHECK(state.epoch() == start);
  }
  RobotState other = state_of(folder, 4);
  REQUIRE(other.begin(EarlierEpochs::kKeep).ok());
  CHECK(other.epoch() == 1);
}

TEST_CASE("RobotState: a map that is continued keeps its epoch; in submaps it is the floor") {
  const bool in_submaps = GENERATE(false, true);
  const StartMap empty = in_submaps ? StartMap::kEmptySubmaps : StartMap::kEmpty;
  const StartMap continued = in_submaps ? StartMap::kSubmaps : StartMap::kContinued;
  const test::TemporaryFolder folder;
  CHECK(state_of(folder).map_epoch() == 0);
  for (std::uint32_t start = 1; start <= 4; ++start) {
    RobotState state = state_of(folder);
    REQUIRE(state.begin(EarlierEpochs::kKeep, start < 3 ? empty : continued).ok());
    REQUIRE(state.note_published(start).ok());
    CHECK(state.map_epoch() == std::min(start, 2U));
  }
  CHECK(state_of(folder).floor() == (in_submaps ? 2 : 3));
  RobotState state = state_of(folder);
  // What is dropped are maps before the one that is continued.
  REQUIRE(state.begin(EarlierEpochs::kDrop, continued).ok());
  CHECK(state.floor() == (in_submaps ? 2 : 5));
  CHECK(state_of(folder).map_epoch() == 2);
  // In submaps nothing of another map counts beside a new one.
  RobotState another = state_of(folder);
  REQUIRE(another.begin(EarlierEpochs::kKeep, empty).ok());
  CHECK(another.map_epoch() == 6);
  CHECK(another.floor() == (in_submaps ? 6 : 5));
}

// By Python's crc32c of the lines before.
TEST_CASE("RobotState: the file is text that people can read") {
  const test::TemporaryFolder folder;
  RobotState state = begun(folder, EarlierEpochs::kKeep);
  REQUIRE(state.note_published(1).ok());
  const std::vector<RobotFloor> heard = {{9, 4}, {1, 17}};
  REQUIRE(state.note_floors(heard).ok());
  CHECK(
      folder.read("robot_3.state") ==
      "tessera-robot-state 1\nrobot 3\nstarts 1\nepoch 1\npublished 1\nfloor 1\nmap 1\nheard 1 17\n"
      "heard 9 4\ncheck a7ba870a\n");
}

TEST_CASE("RobotState: all of it is there after a restart") {
  const test::TemporaryFolder folder;
  {
    RobotState state = begun(folder, EarlierEpochs::kKeep);
    REQUIRE(state.raise_epoch(8).ok());
    REQUIRE(state.raise_starts(20).ok());
    const std::vector<RobotFloor> heard = {{9, 4}, {1, 17}, {9, 3}};
    REQUIRE(state.note_floors(heard).ok());
  }
  const RobotState state = state_of(folder);
  CHECK(state.starts() == 20);
  CHECK(state.epoch() == 8);
  CHECK(state.published() == 7);
  CHECK(state.floor() == 7);
  const std::vector<RobotFloor> kept = {{1, 17}, {9, 4}};
  CHECK(std::equal(kept.begin(), kept.end(), state.floors().begin(), state.floors().end()));
}

TEST_CASE("RobotState: the count of version 0.1.0 goes on, and its file goes") {
  const test::TemporaryFolder folder;
  folder.write("robot_3.starts", "41\n");
  RobotState state = state_of(folder);
  REQUIRE(state.begin(EarlierEpochs::kKeep).ok());
  CHECK(state.starts() == 42);
  CHECK(state.epoch() == 42);
  CHECK(state.floor() == 41);
  CHECK_FALSE(std::filesystem::exists(folder.file("robot_3.starts")));
  // It is read where there is no state, and not otherwise.
  folder.write("robot_3.starts", "99\n");
  CHECK(state_of(folder).starts() == 42);
}

TEST_CASE("RobotState: what is no count of version 0.1.0 is refused and left as it is") {
  const test::TemporaryFolder folder;
  for (const char* const text : {"", "x\n", "1", "0\n", "-1\n", "4294967296\n", "1\n2\n"}) {
    INFO(text);
    folder.write("robot_3.starts", text);
    CHECK_FALSE(RobotState::open(folder.path().string(), 3).ok());
    CHECK(folder.read("robot_3.starts") == text);
  }
}

TEST_CASE("RobotState: a damaged file is refused and left as it is") {
  const test::TemporaryFolder folder;
  RobotState state = begun(folder, EarlierEpochs::kKeep);
  const std::vector<RobotFloor> heard = {{9, 4}, {10, 17}};
  REQUIRE(state.note_floors(heard).ok());
  const std::string whole = folder.read("robot_3.state");
  const auto refused = [&](const std::string& text) {
    folder.write("robot_3.state", text);
    const bool is_refused = !RobotState::open(folder.path().string(), 3).ok();
    return is_refused && folder.read("robot_3.state") == text;
  };
  for (std::size_t i = 0; i < whole.size(); ++i) {
    INFO(i);
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    CHECK(refused(changed));
    CHECK(refused(whole.substr(0, i)));
  }
  CHECK(refused(whole + "\n"));
  CHECK(refused(whole + whole));
  folder.write("robot_3.state", whole);
  std::filesystem::rename(folder.file("robot_3.state"), folder.file("robot_4.state"));
  const Outcome<RobotState> other = RobotState::open(folder.path().string(), 4);
  REQUIRE_FALSE(other.ok());
  CHECK(other.failure().text().find("is of robot 3") != std::string::npos);
}

TEST_CASE("RobotState: with keep the newest earlier epoch that published something counts on") {
  const test::TemporaryFolder folder;
  RobotState first = begun(folder, EarlierEpochs::kKeep);
  CHECK(first.floor() == 1);
  REQUIRE(first.note_published(1).ok());
  CHECK(begun(folder, EarlierEpochs::kKeep).floor() == 1);
  // The second epoch published nothing.
  RobotState third = begun(folder, EarlierEpochs::kKeep);
  CHECK(third.epoch() == 3);
  CHECK(third.floor() == 1);
  REQUIRE(third.note_published(3).ok());
  CHECK(begun(folder, EarlierEpochs::kKeep).floor() == 3);
}

TEST_CASE("RobotState: with drop only the newest epoch counts, and what was dropped stays so") {
  const test::TemporaryFolder folder;
  RobotState first = begun(folder, EarlierEpochs::kKeep);
  REQUIRE(first.note_published(1).ok());
  CHECK(begun(folder, EarlierEpochs::kDrop).floor() == 2);
  CHECK(begun(folder, EarlierEpochs::kKeep).floor() == 2);
}

TEST_CASE("RobotState: what the fleet heard of this robot raises its epoch and its starts") {
  const test::TemporaryFolder folder;
  for (const EarlierEpochs earlier : {EarlierEpochs::kKeep, EarlierEpochs::kDrop}) {
    std::filesystem::remove(folder.file("robot_3.state"));
    RobotState state = begun(folder, earlier);
    REQUIRE(state.raise_epoch(8).ok());
    CHECK(state.epoch() == 8);
    CHECK(state.floor() == (earlier == EarlierEpochs::kKeep ? 7U : 8U));
    REQUIRE(state.raise_epoch(5).ok());
    CHECK(state.epoch() == 8);
    REQUIRE(state.raise_starts(6).ok());
    REQUIRE(state.raise_starts(2).ok());
    CHECK(state.starts() == 6);
    CHECK(state_of(folder).epoch() == 8);
  }
}

TEST_CASE("RobotState: counts at their end are refused, and nothing changes") {
  const test::TemporaryFolder folder;
  RobotState state = begun(folder, EarlierEpochs::kKeep);
  CHECK_FALSE(state.raise_epoch(std::uint64_t{kMost32} + 1).ok());
  CHECK_FALSE(state.raise_starts(std::uint64_t{kMost32} + 1).ok());
  CHECK(state.epoch() == 1);
  REQUIRE(state.raise_epoch(kMost32).ok());
  CHECK_FALSE(state.begin(EarlierEpochs::kKeep).ok());
  CHECK(state.starts() == 1);
}

TEST_CASE("RobotState: floors of 256 robots are remembered, and the highest of each") {
  const test::TemporaryFolder folder;
  RobotState state = begun(folder, EarlierEpochs::kKeep);
  std::vector<RobotFloor> heard;
  for (std::uint32_t robot = 300; robot > 0; --robot) heard.push_back({robot, 2});
  REQUIRE(state.note_floors(heard).ok());
  CHECK(state.floors().size() == RobotState::kMostFloors);
  CHECK(state.floors_refused() == 299 - RobotState::kMostFloors);  // Its own is none of them.
  for (std::size_t i = 1; i < state.floors().size(); ++i)
    CHECK(state.floors()[i - 1].robot < state.floors()[i].robot);
  const RobotState again = state_of(folder);
  CHECK(again.floors().size() == RobotState::kMostFloors);
}

TEST_CASE("RobotState: what is no news writes nothing") {
  const test::TemporaryFolder folder;
  RobotState state = begun(folder, EarlierEpochs::kKeep);
  const std::vector<RobotFloor> heard = {{9, 4}};
  REQUIRE(state.note_floors(heard).ok());
  REQUIRE(state.note_published(1).ok());
  std::filesystem::remove(folder.file("robot_3.state"));
  const std::vector<RobotFloor> old = {{9, 4}, {9, 2}, {3, 70}};
  CHECK(state.note_floors(old).ok());
  CHECK(state.note_published(1).ok());
  CHECK(state.raise_epoch(1).ok());
  CHECK(state.raise_starts(0).ok());
  CHECK_FALSE(std::filesystem::exists(folder.file("robot_3.state")));
}

TEST_CASE("RobotState: where the file cannot be written nothing changes") {
  const test::TemporaryFolder folder;
  RobotState state = begun(folder, EarlierEpochs::kKeep);
  std::filesystem::remove_all(folder.path());
  CHECK_FALSE(state.note_published(1).ok());
  CHECK(state.published() == 0);
  CHECK_FALSE(state.raise_epoch(9).ok());
  CHECK(state.epoch() == 1);
}

}  // namespace
}  // namespace tessera
