// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot that takes classes for others: what it does to the map of a team, and what is left of
// that whatever comes in which order.
#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

GlobalMapConfig judged_config() {
  GlobalMapConfig config = team_config(TuplePolicy::kCompact);
  config.diffusion.iterations = 2;
  return config;
}

std::uint64_t fused_digest(const GlobalMapConfig& config, std::initializer_list<Says> robots) {
  Team team(config);
  std::uint32_t robot = 0;
  for (const Says says : robots) team.publish(striped_ground(robot++, says), 1);
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
    OracleContribution one = striped_ground(robot, robot == 1 ? lie : honestly);
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
  team.publish(striped_ground(0, honestly), 1);
  team.publish(striped_ground(1, swapped), 1);
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
  team.publish(striped_ground(0, honestly), 1);
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

/// Robot 0 in two submaps, robot 3 in a turned frame.
std::vector<OracleContribution> team_of(const std::vector<Says>& day, const Matrix34d& T) {
  std::vector<OracleContribution> all;
  for (std::uint32_t robot = 0; robot < day.size(); ++robot) {
    OracleContribution one = striped_ground(robot, day[robot]);
    if (robot == 3) one.T_global_local = T;
    if (robot == 0) {
      OracleContribution other = one;
      other.id.submap = 1;
      std::erase_if(one.voxels, [](const auto& voxel) { return voxel.first[0] > 40; });
      std::erase_if(other.voxels, [](const auto& voxel) { return voxel.first[0] < 20; });
      all.push_back(other);
    }
    all.push_back(one);
  }
  return all;
}

TEST_CASE("reliability: any order, change of mind, move and cutting up of work is as fusing anew") {
  Random random(announce_seed(23));
  GlobalMapConfig config = judged_config();
  config.max_evidence = 9.0F;  // the submaps of one robot exceed it together
  Team team(config);
  const std::vector<std::vector<Says>> days{{honestly, honestly, honestly, honestly},
                                            {honestly, swapped, permuted, honestly},
                                            {permuted, swapped, honestly, honestly},
                                            {honestly, honestly, swapped, swapped},
                                            {honestly, honestly, swapped, honestly}};
  std::uint32_t version = 0;
  for (const std::vector<Says>& day : days) {
    ++version;
    struct Chunk {
      GlobalMap::Slot slot;
      std::uint64_t key;
      std::vector<std::byte> bytes;
    };
    const Matrix34d T = random_transform(random, 20.0, 0.3);
    std::vector<Chunk> chunks;
    for (const OracleContribution& one : team_of(day, T)) {
      const GlobalMap::Slot slot = *team.global().open(one.id, GridTransform());
      for (auto& [key, bytes] : pack_voxels(one.voxels)) chunks.push_back({slot, key, bytes});
    }
    for (std::size_t i = chunks.size(); i > 1; --i)
      std::swap(chunks[i - 1], chunks[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
    for (const Chunk& chunk : chunks) {
      REQUIRE(team.global().put(chunk.slot, BlockKey{chunk.key}, version, chunk.bytes).ok());
      if (random.below(5) == 0) team.global().step(static_cast<std::uint64_t>(random.below(9000)));
      if (&chunk != &chunks[chunks.size() / 2]) continue;
      CHECK(team.global().set_frame(*team.global().replicas().find({3, 0, 0}),
                                    *GridTransform::make(T, 0.1),
                                    version) == Replicas::Change::kTaken);
    }
    team.settle();
    Team anew(config);
    for (const OracleContribution& one : team_of(day, T)) anew.publish(one, 1);
    anew.settle();
    REQUIRE(team.digest() == anew.digest());
    for (std::uint32_t robot = 0; robot < day.size(); ++robot)
      CHECK(judged(team, robot).named == judged(anew, robot).named);
  }
}

TEST_CASE("reliability: weighing changes no voxel's evidence, and so nothing that is occupied") {
  GlobalMapConfig config = judged_config();
  config.diffusion.iterations = 0;
  const auto fused = [&] {
    auto team = std::make_unique<Team>(config);
    for (std::uint32_t robot = 0; robot < 3; ++robot)
      team->publish(striped_ground(robot, robot == 1 ? permuted : honestly), 1);
    team->settle();
    return team;
  };
  const auto weighed = fused();
  config.diffusion.weigh_robots = false;
  const auto plain = fused();
  CHECK(judged(*weighed, 1).reliability == 0.0F);
  const OracleVoxels with = voxels_of(weighed->global().map());
  const OracleVoxels without = voxels_of(plain->global().map());
  REQUIRE(with.size() == without.size());
  for (const auto& [voxel, counts] : with) {
    double sum = 0.0;
    double expected = 0.0;
    const OracleCounts& others = without.at(voxel);
    for (std::size_t c = 1; c < counts.size(); ++c) {
      sum += counts[c];
      expected += others[c];
    }
    REQUIRE(sum == Approx(expected).epsilon(0.02));  // compact counts
    REQUIRE(counts[0] == others[0]);
    REQUIRE(weighed->global().query(coord_of(voxel)).state ==
            plain->global().query(coord_of(voxel)).state);
  }
}

TEST_CASE("reliability: when the others have gone nobody is judged any more") {
  const GlobalMapConfig config = judged_config();
  Team team(config);
  for (std::uint32_t robot = 0; robot < 3; ++robot)
    team.publish(striped_ground(robot, robot == 1 ? permuted : honestly), 1);
  team.settle();
  REQUIRE(judged(team, 1).named != 0);
  team.global().remove(*team.global().replicas().find({2, 0, 0}));
  team.settle();
  CHECK(judged(team, 1).named == 0);
  CHECK(team.digest() == fused_digest(config, {honestly, permuted}));
  // One that comes in its place is another one, also before that is known.
  team.global().remove(*team.global().replicas().find({1, 0, 0}));
  while (team.global().replicas().find({1, 0, 0}).ok()) team.global().step(500);
  team.publish(striped_ground(4, honestly), 1);
  team.publish(striped_ground(1, permuted), 2);
  team.publish(striped_ground(7, honestly), 1);
  team.settle();
  CHECK(judged(team, 1).named != 0);
  CHECK(judged(team, 4).named == 0);
  CHECK(judged(team, 7).named == 0);
}

TEST_CASE(
    "reliability: where there is no room for what blocks say it is counted, and the map goes on") {
  GlobalMapConfig config = judged_config();
  config.sum_segments = 1;
  Team team(config);
  for (std::uint32_t robot = 0; robot < 3; ++robot)
    team.publish(striped_ground(robot, robot == 1 ? permuted : honestly), 1);
  team.settle();
  const GlobalMapReport report = team.global().report();
  CHECK(report.refused_tallies != 0);
  CHECK(report.refused_sums != 0);
  CHECK(team.global().query({3, 3, 0}).state == VoxelState::kOccupied);
}

}  // namespace
}  // namespace tessera::oracle
