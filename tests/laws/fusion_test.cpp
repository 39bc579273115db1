// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The laws of the global map: it hangs on what has arrived alone, not on when, how often or in
// which order, nor on how the work was cut up.
#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

struct Robot {
  OracleContribution contribution;
  std::uint32_t frame_revision = 0;
  bool removed = false;
  std::map<std::uint64_t, std::pair<std::uint32_t, std::vector<std::byte>>> published;
  GlobalMap::Slot slot = 0;
};

/// Some block anew, some voxels of the robot changed.
void change(Robot& robot, Random& random, std::uint32_t version) {
  const OracleVoxels more = random_voxels(random, 30, {0, 0, 0});
  for (const auto& [voxel, counts] : more) robot.contribution.voxels[voxel] = counts;
  for (const auto& [key, bytes] : pack_voxels(robot.contribution.voxels)) {
    auto& held = robot.published[key];
    if (held.second != bytes) held = {version, bytes};
  }
}

std::uint64_t digest_anew(const GlobalMapConfig& config, std::vector<Robot>& robots,
                          Random& random) {
  Team team(config);
  struct Chunk {
    const Robot* robot;
    std::uint64_t key;
  };
  std::vector<Chunk> chunks;
  for (const Robot& robot : robots) {
    if (robot.removed) continue;
    for (const auto& [key, held] : robot.published) chunks.push_back({&robot, key});
  }
  for (std::size_t i = chunks.size(); i > 1; --i)
    std::swap(chunks[i - 1], chunks[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  for (const Chunk& chunk : chunks) {
    const OracleContribution& c = chunk.robot->contribution;
    const GlobalMap::Slot slot =
        *team.global().open(c.id, *GridTransform::make(c.T_global_local, 0.1));
    const auto& [version, bytes] = chunk.robot->published.at(chunk.key);
    REQUIRE(team.global().put(slot, BlockKey{chunk.key}, version, bytes).ok());
  }
  team.settle();
  return team.digest();
}

/// Some of a robot's blocks, some of them late or twice.
void put_some(GlobalMap& global, const Robot& robot, const decltype(Robot::published)& before,
              Random& random) {
  for (const auto& block : robot.published) {
    const auto put = [&](const std::pair<std::uint32_t, std::vector<std::byte>>& what) {
      REQUIRE(global.put(robot.slot, BlockKey{block.first}, what.first, what.second).ok());
    };
    if (random.below(3) == 0) put(block.second);
    const auto late = before.find(block.first);
    if (random.below(5) == 0 && late != before.end()) put(late->second);
    if (random.below(5) == 0) put(block.second);
  }
}

TEST_CASE("fusion: any order, repetition, move and cutting up of work is as fusing anew") {
  const auto mode =
      GENERATE(DiffusionMode::kContractive, DiffusionMode::kPaper, DiffusionMode::kNone);
  const auto tuple = GENERATE(TuplePolicy::kCompact, TuplePolicy::kDense);
  const int robots_count = GENERATE(3, 8);
  CAPTURE(to_string(mode), robots_count);
  Random random(announce_seed(71));
  GlobalMapConfig config = team_config(tuple);
  config.diffusion.mode = mode;
  config.diffusion.edge = EdgeTerm::kConfidence;
  config.diffusion.iterations = mode == DiffusionMode::kPaper ? 2 : 4;
  config.diffusion.length_m = 0.2F;
  config.max_evidence = 4.0F;  // Reached by many.
  Team team(config);
  std::vector<Robot> robots(static_cast<std::size_t>(robots_count));
  for (std::size_t i = 0; i < robots.size(); ++i) {
    OracleContribution& c = robots[i].contribution;
    // Two submaps of one robot among them, and three epochs of another.
    c.id = {static_cast<std::uint32_t>(i == 1 ? 0 : i), 0, static_cast<std::uint32_t>(i == 1)};
    if (i > 4) c.id = {4, static_cast<std::uint32_t>(9 - i), 0};
    if (i % 3 != 0) c.T_global_local = random_transform(random, 25.0 * random.uniform(), 0.5);
    change(robots[i], random, 1);
    robots[i].slot = *team.global().open(c.id, *GridTransform::make(c.T_global_local, 0.1));
  }
  for (std::uint32_t version = 2; version < 60; ++version) {
    Robot& robot = robots[static_cast<std::size_t>(random.below(robots_count))];
    if (robot.removed) continue;
    const auto before = robot.published;
    if (random.below(2) == 0) change(robot, random, version);
    put_some(team.global(), robot, before, random);
    if (random.below(4) == 0) {
      // Two at once, of which an older one comes late.
      robot.contribution.T_global_local = random_transform(random, 40.0 * random.uniform(), 0.5);
      const GridTransform frame = *GridTransform::make(robot.contribution.T_global_local, 0.1);
      robot.frame_revision += 2;
      CHECK(team.global().set_frame(robot.slot, frame, robot.frame_revision) ==
            Replicas::Change::kTaken);
      CHECK(team.global().set_frame(robot.slot, GridTransform(), robot.frame_revision - 1) ==
            Replicas::Change::kStale);
    }
    if (robots_count > 3 && version % 20 == 0) {
      team.global().remove(robot.slot);
      robot.removed = true;
    }
    team.global().set_focus(BlockCoord{random.below(3), random.below(3), 0});
    team.global().step(static_cast<std::uint64_t>(random.below(20000)));
  }
  for (const Robot& robot : robots) {
    for (const auto& [key, held] : robot.published) {
      if (robot.removed) continue;
      REQUIRE(team.global().put(robot.slot, BlockKey{key}, held.first, held.second).ok());
    }
  }
  team.settle();
  const std::uint64_t found = team.digest();
  CHECK(found == digest_anew(config, robots, random));
  CHECK(found == digest_anew(config, robots, random));
  CHECK(team.global().report().nodes > 50);
  CHECK(team.global().report().replicas.replicas_stale > 10);
}

/// A floor of 24 x 24 voxels, in stripes of two classes, and one voxel above its middle.
OracleVoxels striped_floor(double above) {
  OracleVoxels voxels;
  for (std::int64_t x = 0; x < 24; ++x) {
    for (std::int64_t y = 0; y < 24; ++y) {
      OracleCounts& counts = voxels[Voxel{x, y, 0}];
      counts.resize(kTeamClasses + 2);
      counts[x / 3 % 2 == 0 ? 1 : 2] = 4.0;
    }
  }
  OracleCounts& counts = voxels[Voxel{12, 12, 1}];
  counts.resize(kTeamClasses + 2);
  counts[1] = above;
  return voxels;
}

TEST_CASE("fusion: all voxels around one of next to no evidence diffuse") {
  const double least = GENERATE(1e-39, static_cast<double>(kLeastCount));
  const auto edge = GENERATE(EdgeTerm::kConfidence, EdgeTerm::kSimilarity);
  CAPTURE(least, to_string(edge));
  const auto fused = [&](DiffusionMode mode, double& residual) {
    GlobalMapConfig config = team_config(TuplePolicy::kDense);
    config.diffusion.mode = mode;
    config.diffusion.edge = edge;
    Team team(config);
    team.publish({.id = {0, 0, 0}, .voxels = striped_floor(least)}, 1);
    team.publish({.id = {1, 0, 0}, .voxels = striped_floor(0.0)}, 1);
    team.settle();
    residual = team.global().report().residual;
    return voxels_of(team.global().map());
  };
  double residual = 0.0;
  const OracleVoxels undiffused = fused(DiffusionMode::kNone, residual);
  const OracleVoxels diffused = fused(DiffusionMode::kContractive, residual);
  int same = 0;
  for (const auto& [voxel, counts] : undiffused)
    same += voxel[2] == 0 && diffused.at(voxel) == counts ? 1 : 0;
  CHECK(same == 0);
  CHECK(residual > 0.0);
  CHECK(residual < 1.0);
}

TEST_CASE("fusion: a robot that says nothing new changes nothing, and costs no diffusion") {
  Random random(announce_seed(72));
  const GlobalMapConfig config = team_config(TuplePolicy::kCompact);
  Team team(config);
  const std::vector<OracleContribution> contributions = publish_random(team, random, 2, 300);
  const std::uint64_t before = team.digest();
  team.publish(contributions[0], 1);
  CHECK(team.global().waiting() == 0);
  team.publish(contributions[0], 2);
  CHECK(team.global().waiting() != 0);
  std::uint64_t work = 0;
  std::uint64_t steps = 0;
  for (; team.global().waiting() != 0; ++steps) work += team.global().step(1);
  CHECK(work < 3 * 300 * 10);
  CHECK(team.digest() == before);
}

TEST_CASE("fusion: blocks that hang on more than memory holds are done in smaller parts") {
  // Every voxel of 3 x 3 x 3 blocks is a node with 80 edges: together more than there is room for.
  GlobalMapConfig config = team_config();
  config.diffusion.iterations = 1;
  config.diffusion.length_m = 0.28F;
  std::vector<OracleContribution> contributions(2);
  for (std::uint32_t robot = 0; robot < 2; ++robot) {
    contributions[robot].id = {robot, 0, 0};
    for (std::int64_t i = 0; i < 24 * 24 * 24; ++i) {
      OracleCounts counts(kTeamClasses + 2);
      counts[static_cast<std::size_t>(1 + (i / 7 + robot) % 3)] = 1.0 + static_cast<double>(i % 5);
      contributions[robot].voxels[{i % 24, i / 24 % 24, i / 576}] = counts;
    }
  }
  Team together(config);
  for (const OracleContribution& contribution : contributions) together.publish(contribution, 1);
  together.settle();
  CHECK(together.global().report().nodes == 24 * 24 * 24);
  // One block after the other, each brought up to date before the next.
  Team apart(config);
  for (const OracleContribution& contribution : contributions) {
    const GlobalMap::Slot slot = *apart.global().open(contribution.id, GridTransform());
    for (const auto& [key, bytes] : pack_voxels(contribution.voxels)) {
      REQUIRE(apart.global().put(slot, BlockKey{key}, 1, bytes).ok());
      apart.settle();
    }
  }
  CHECK(together.digest() == apart.digest());
}

TEST_CASE("fusion: what has no room is counted, and the rest is there") {
  Random random(announce_seed(81));
  GlobalMapConfig config = team_config();
  SECTION("sums") { config.sum_segments = 2; }
  SECTION("places of the grid") { config.blocks = 2; }
  SECTION("the map") { config.map.storage_bytes = 4 * SlabPool::kPageBytes; }
  Team team(config);
  std::uint64_t refused = 0;
  for (std::uint32_t robot = 0; robot < 2; ++robot) {
    const GlobalMap::Slot slot = *team.global().open({robot, 0, 0}, GridTransform());
    for (const auto& [key, bytes] : pack_voxels(random_voxels(random, 600, {0, 0, 0})))
      refused += team.global().put(slot, BlockKey{key}, 1, bytes).ok() ? 0U : 1U;
  }
  team.settle();
  const GlobalMapReport report = team.global().report();
  CHECK(refused == (config.blocks == 2 ? report.refused_blocks : 0U));
  CHECK(report.refused_blocks + report.refused_sums + report.refused_outputs > 0);
  CHECK(team.global().map().usage().label_voxels > 0);
}

TEST_CASE("fusion: a block that comes in parts, in whatever order, is the block") {
  Random random(announce_seed(81));
  std::vector<OracleContribution> contributions(2);
  Team whole(team_config());
  Team in_parts(team_config());
  for (std::uint32_t i = 0; i < 2; ++i) {
    contributions[i].id = {i, 0, 0};
    contributions[i].voxels = random_voxels(random, 300, {0, 0, 0});
    contributions[i].T_global_local = random_transform(random, 20.0, 0.3);
    whole.publish(contributions[i], 9);
    // What was known before, then layer by layer, some twice, the last layer's first.
    OracleContribution older = contributions[i];
    older.voxels = random_voxels(random, 300, {0, 0, 0});
    for (const auto& [voxel, counts] : contributions[i].voxels) older.voxels[voxel] = counts;
    in_parts.publish(older, 2);
    const GlobalMap::Slot slot = *in_parts.global().replicas().find(older.id);
    for (const std::uint32_t layer : {3U, 1U, 0U, 3U, 2U}) {
      OracleVoxels of_layer;
      for (const auto& [voxel, counts] : contributions[i].voxels) {
        if (layer_of_row(row_order(coord_of(voxel))) == layer) of_layer[voxel] = counts;
      }
      const PackedBlocks packed = pack_voxels(of_layer);
      for (const auto& [key, bytes] : pack_voxels(older.voxels)) {
        const auto part = packed.find(key);
        const PartVersion version{
            .number = 3 + layer, .first = 3, .layers = static_cast<std::uint8_t>(1U << layer)};
        REQUIRE(in_parts.global()
                    .put(slot, BlockKey{key}, version,
                         part == packed.end() ? std::span<const std::byte>{} : part->second)
                    .ok());
      }
      in_parts.global().step(static_cast<std::uint64_t>(random.below(5000)));
    }
  }
  whole.settle();
  in_parts.settle();
  CHECK(in_parts.digest() == whole.digest());
}

}  // namespace
}  // namespace tessera::oracle
