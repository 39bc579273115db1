// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot that takes classes for others: what it does to the map of a team, and what is left of
// that whatever comes in which order.
#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

using Says = int (*)(int truth);
int honestly(int truth) { return truth; }
int swapped(int truth) { return truth == 1 ? 2 : truth == 2 ? 1 : truth; }
int permuted(int truth) { return truth % 3 + 1; }

/// Strips of classes 1, 2 and 3 on the ground: all robots see x of 0 to 63, and each a place of its
/// own, from 100 (robot + 1) on.
OracleContribution ground(std::uint32_t robot, Says says) {
  OracleContribution contribution;
  contribution.id = {robot, 0, 0};
  const auto put = [&](std::int64_t x, std::int64_t y) {
    OracleCounts counts(kTeamClasses + 2);
    counts[static_cast<std::size_t>(says(static_cast<int>(y / 16) + 1))] = 5.0 + robot;
    counts[0] = (x + y) % 3 == 0 ? 1.0 : 0.0;
    contribution.voxels[{x, y, 0}] = counts;
  };
  for (std::int64_t y = 0; y < 48; ++y) {
    for (std::int64_t x = 0; x < 64; ++x) put(x, y);
    for (std::int64_t x = 0; x < 8; ++x) put(100 * (robot + 1) + x, y);
  }
  return contribution;
}

GlobalMapConfig judged_config() {
  GlobalMapConfig config = team_config(TuplePolicy::kCompact);
  config.diffusion.iterations = 2;
  return config;
}

std::uint64_t fused_digest(const GlobalMapConfig& config, std::initializer_list<Says> robots) {
  Team team(config);
  std::uint32_t robot = 0;
  for (const Says says : robots) team.publish(ground(robot++, says), 1);
  team.settle();
  return team.digest();
}

RobotReliability judged(const Team& team, std::uint32_t robot) {
  return *team.global().reliability(robot);
}

TEST_CASE("reliability: honest robots are fused as if nobody were judged, bit for bit") {
  GlobalMapConfig config = judged_config();
  const std::uint64_t weighed = fused_digest(config, {honestly, honestly, honestly});
  config.diffusion.weigh_robots = false;
  CHECK(fused_digest(config, {honestly, honestly, honestly}) == weighed);
}

TEST_CASE("reliability: two of three outvote a robot that has more evidence than both") {
  const Says lie = GENERATE(&swapped, &permuted);
  GlobalMapConfig config = judged_config();
  config.diffusion.iterations = 0;  // so much of what it is right in would go over its borders
  Team team(config);
  for (std::uint32_t robot = 0; robot < 3; ++robot) {
    OracleContribution one = ground(robot, robot == 1 ? lie : honestly);
    for (auto& [voxel, counts] : one.voxels) {
      for (std::size_t c = 1; robot == 1 && c < counts.size(); ++c) counts[c] *= 10.0;
    }
    team.publish(one, 1);
  }
  team.settle();
  CHECK(judged(team, 0).named == 0);
  CHECK(judged(team, 2).named == 0);
  CHECK(judged(team, 1).named == (lie == &swapped ? 0b0110U : 0b1110U));
  for (int y = 0; y < 48; ++y) {
    const int truth = y / 16 + 1;
    for (int x = 0; x < 64; ++x) REQUIRE(team.global().query({x, y, 0}).label == truth);
    // What it alone has seen is there, but as nothing that is known.
    const Estimate alone = team.global().query({203, y, 0});
    REQUIRE(alone.state == VoxelState::kOccupied);
    REQUIRE(alone.label == (lie(truth) == truth ? truth : 0));
    REQUIRE(team.global().query({103, y, 0}).label == truth);
  }
}

TEST_CASE(
    "reliability: with two nobody knows who is wrong: both count, and that they differ is said") {
  GlobalMapConfig config = judged_config();
  Team team(config);
  team.publish(ground(0, honestly), 1);
  team.publish(ground(1, swapped), 1);
  team.settle();
  for (const std::uint32_t robot : {0U, 1U}) {
    CHECK(judged(team, robot).shared == 64 * 48);
    CHECK(judged(team, robot).differing == 64 * 32);
    CHECK(judged(team, robot).judged == 0);
    CHECK(judged(team, robot).named == 0);
  }
  config.diffusion.weigh_robots = false;
  CHECK(fused_digest(config, {honestly, swapped}) == team.digest());
}

TEST_CASE("reliability: of robots and classes that are not there nothing is said") {
  Team team(judged_config());
  team.publish(ground(0, honestly), 1);
  team.settle();
  CHECK(team.global().reliability(1).status() == Status::kOutOfRange);
  CHECK(team.global().reliability(1, 1).status() == Status::kOutOfRange);
  CHECK(team.global().reliability(0, 0).status() == Status::kOutOfRange);
  CHECK(team.global().reliability(0, kTeamClasses + 1).status() == Status::kOutOfRange);
  CHECK(team.global().reliability(0, kTeamClasses).ok());
}

TEST_CASE("reliability: the paper's modes are to the letter, whoever is wrong") {
  GlobalMapConfig config = judged_config();
  config.diffusion.mode = GENERATE(DiffusionMode::kNone, DiffusionMode::kPaper);
  const std::uint64_t as_it_is = fused_digest(config, {honestly, swapped, honestly});
  config.diffusion.weigh_robots = false;
  CHECK(fused_digest(config, {honestly, swapped, honestly}) == as_it_is);
}

TEST_CASE("reliability: any order, change of mind, move and cutting up of work is as fusing anew") {
  Random random(announce_seed(23));
  const GlobalMapConfig config = judged_config();
  Team team(config);
  const std::vector<std::vector<Says>> days{{honestly, honestly, honestly, honestly},
                                            {honestly, swapped, permuted, honestly},
                                            {permuted, swapped, honestly, honestly},
                                            {honestly, honestly, swapped, honestly}};
  std::uint32_t version = 0;
  for (const std::vector<Says>& day : days) {
    ++version;
    struct Chunk {
      GlobalMap::Slot slot;
      std::uint64_t key;
      std::vector<std::byte> bytes;
    };
    std::vector<Chunk> chunks;
    for (std::uint32_t robot = 0; robot < day.size(); ++robot) {
      const OracleContribution one = ground(robot, day[robot]);
      const GlobalMap::Slot slot = *team.global().open(one.id, GridTransform());
      for (auto& [key, bytes] : pack_voxels(one.voxels)) chunks.push_back({slot, key, bytes});
    }
    for (std::size_t i = chunks.size(); i > 1; --i)
      std::swap(chunks[i - 1], chunks[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
    for (const Chunk& chunk : chunks) {
      REQUIRE(team.global().put(chunk.slot, BlockKey{chunk.key}, version, chunk.bytes).ok());
      if (random.below(5) == 0) team.global().step(static_cast<std::uint64_t>(random.below(3000)));
    }
    Matrix34d T = Matrix34d::Identity();
    T(0, 3) = 0.1 * version;
    const GlobalMap::Slot moved = *team.global().replicas().find({3, 0, 0});
    CHECK(team.global().set_frame(moved, *GridTransform::make(T, 0.1), version) ==
          Replicas::Change::kTaken);
    team.settle();
    Team anew(config);
    for (std::uint32_t robot = 0; robot < day.size(); ++robot) {
      OracleContribution one = ground(robot, day[robot]);
      if (robot == 3) one.T_global_local = T;
      anew.publish(one, 1);
    }
    anew.settle();
    REQUIRE(team.digest() == anew.digest());
    for (std::uint32_t robot = 0; robot < day.size(); ++robot)
      CHECK(judged(team, robot).named == judged(anew, robot).named);
  }
}

TEST_CASE("reliability: when the others have gone nobody is judged any more") {
  const GlobalMapConfig config = judged_config();
  Team team(config);
  for (std::uint32_t robot = 0; robot < 3; ++robot)
    team.publish(ground(robot, robot == 1 ? permuted : honestly), 1);
  team.settle();
  REQUIRE(judged(team, 1).named != 0);
  team.global().remove(*team.global().replicas().find({2, 0, 0}));
  team.settle();
  CHECK(judged(team, 1).named == 0);
  CHECK(team.digest() == fused_digest(config, {honestly, permuted}));
  // One that comes in its place is another one.
  team.publish(ground(7, honestly), 1);
  team.settle();
  CHECK(judged(team, 1).named != 0);
  CHECK(judged(team, 7).named == 0);
}

TEST_CASE(
    "reliability: where there is no room for what blocks say it is counted, and the map goes on") {
  GlobalMapConfig config = judged_config();
  config.sum_segments = 1;
  Team team(config);
  for (std::uint32_t robot = 0; robot < 3; ++robot)
    team.publish(ground(robot, robot == 1 ? permuted : honestly), 1);
  team.settle();
  const GlobalMapReport report = team.global().report();
  CHECK(report.refused_tallies != 0);
  CHECK(report.refused_sums != 0);
  CHECK(team.global().query({3, 3, 0}).state == VoxelState::kOccupied);
}

}  // namespace
}  // namespace tessera::oracle
