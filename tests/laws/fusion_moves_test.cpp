// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Contributions that move or leave: nothing is sent anew, readers see all of it before or all of it
// after, and the end is as fusing anew.
#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

TEST_CASE("fusion: while a contribution moves, readers see all of it before or all of it after") {
  const bool removed = GENERATE(false, true);
  const auto tuple = GENERATE(TuplePolicy::kCompact, TuplePolicy::kDense);
  Random random(announce_seed(74));
  GlobalMapConfig config = team_config(tuple);
  config.diffusion.edge = EdgeTerm::kConfidence;
  Team team(config);
  const std::vector<OracleContribution> contributions = publish_random(team, random, 3, 400);
  GlobalMap& global = team.global();
  const GlobalMap::Slot slot = *global.replicas().find({1, 0, 0});
  std::map<Voxel, double> seen;
  const auto note_all = [&] {
    for (const auto& [voxel, counts] : voxels_of(global.map())) seen[voxel] = 0.0;
  };
  const auto look = [&] {
    std::map<Voxel, double> view = seen;
    for (auto& [v, evidence] : view) {
      const Estimate e =
          global.query({static_cast<std::int32_t>(v[0]), static_cast<std::int32_t>(v[1]),
                        static_cast<std::int32_t>(v[2])});
      evidence = e.evidence + 1000.0 * e.label;
    }
    return view;
  };
  // What it will be, so that no voxel is overlooked.
  const Matrix34d T = random_transform(random, 25.0, 0.7);
  Team after(config);
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (i == 1 && removed) continue;
    OracleContribution contribution = contributions[i];
    if (i == 1) contribution.T_global_local = T;
    after.publish(contribution, 1);
  }
  after.settle();
  note_all();
  for (const auto& [voxel, counts] : voxels_of(after.global().map())) seen[voxel] = 0.0;
  const std::map<Voxel, double> before = look();
  if (removed) {
    global.remove(slot);
  } else {
    REQUIRE(global.set_frame(slot, *GridTransform::make(T, 0.1), 1) == Replicas::Change::kTaken);
  }
  int slices_before = 0;
  int slices_after = 0;
  std::map<Voxel, double> moved;
  while (global.busy()) {
    global.step(300);
    if (global.generation() == 0) {
      ++slices_before;
      REQUIRE(look() == before);
    } else {
      if (slices_after++ == 0) moved = look();
      REQUIRE(look() == moved);
    }
  }
  CHECK(slices_before > 5);
  CHECK(slices_after > 5);
  CHECK(moved != before);
  CHECK(team.digest() == after.digest());
  CHECK(global.report().torn_blocks == 0);
  CHECK(global.replicas().usage().contributions == (removed ? 2 : 3));
  CHECK(global.settled());
}

TEST_CASE("fusion: a move ends, however little is done at a time") {
  Random random(announce_seed(77));
  const std::uint64_t budget = GENERATE(1U, 7U, 300U);
  Team team(team_config());
  static_cast<void>(publish_random(team, random, 2, 60));
  GlobalMap& global = team.global();
  const GridTransform frame = *GridTransform::make(random_transform(random, 25.0, 0.7), 0.1);
  CHECK(global.set_frame(0, frame, 1) == Replicas::Change::kTaken);
  global.remove(1);
  int steps = 0;
  for (; global.busy() && steps < 200000; ++steps) global.step(budget);
  CHECK(steps < 200000);
  CHECK(global.replicas().usage().contributions == 1);
}

TEST_CASE("fusion: a robot that was removed may come back") {
  Random random(announce_seed(75));
  Team team(team_config());
  OracleContribution contribution;
  contribution.id = {4, 0, 0};
  contribution.voxels = random_voxels(random, 100, {0, 0, 0});
  team.publish(contribution, 1);
  team.settle();
  const std::uint64_t before = team.digest();
  GlobalMap& global = team.global();
  const GlobalMap::Slot slot = *global.replicas().find(contribution.id);
  global.remove(slot);
  CHECK(global.put(slot, BlockKey{1}, 2, {}).status() == Status::kBusy);
  team.settle();
  CHECK(global.map().block_count() == 0);
  CHECK(global.report().blocks == 0);
  team.publish(contribution, 1);
  team.settle();
  CHECK(team.digest() == before);
}

TEST_CASE("fusion: a move without room to stage it is made all the same, and counted") {
  Random random(announce_seed(76));
  GlobalMapConfig config = team_config();
  config.staged_bytes = 4 * SlabPool::kPageBytes;
  Team team(config);
  OracleContribution contribution;
  contribution.voxels = random_voxels(random, 400, {0, 0, 0});
  team.publish(contribution, 1);
  team.settle();
  contribution.T_global_local = random_transform(random, 25.0, 0.7);
  REQUIRE(team.global().set_frame(0, *GridTransform::make(contribution.T_global_local, 0.1), 1) ==
          Replicas::Change::kTaken);
  team.settle();
  CHECK(team.global().report().torn_blocks > 0);
  Team after(team_config());
  after.publish(contribution, 1);
  after.settle();
  CHECK(team.digest() == after.digest());
}

TEST_CASE("fusion: what always arrives is seen all the same, and puts off no move") {
  Random random(announce_seed(78));
  Team team(team_config());
  const std::vector<OracleContribution> contributions = publish_random(team, random, 2, 200);
  GlobalMap& global = team.global();
  REQUIRE(global.set_frame(0, *GridTransform::make(random_transform(random, 20.0, 0.4), 0.1), 1) ==
          Replicas::Change::kTaken);
  // A block that both robots see changes at every step, and a brick takes several.
  const PackedBlocks all = pack_voxels(contributions[1].voxels);
  const auto larger = [](const auto& a, const auto& b) {
    return a.second.size() < b.second.size();
  };
  const std::uint64_t key = std::max_element(all.begin(), all.end(), larger)->first;
  const BlockCoord block = unpack(BlockKey{key});
  OracleVoxels of_block;
  for (const auto& [voxel, counts] : contributions[1].voxels) {
    if (block_of(coord_of(voxel)) == block) of_block[voxel] = counts;
  }
  // Of the block itself: around it much changes that is not under way again.
  const VoxelCoord watched = coord_of(of_block.begin()->first);
  double evidence = global.query(watched).evidence;
  std::uint64_t seen = 0;
  std::uint32_t version = 2;
  const GlobalMap::Slot slot = *global.replicas().find({1, 0, 0});
  for (; version < 3000 && (global.generation() == 0 || seen < 20); ++version) {
    for (auto& [voxel, counts] : of_block) counts[1] = static_cast<double>(version % 64 + 1) / 64.0;
    REQUIRE(global.put(slot, BlockKey{key}, version, pack_voxels(of_block).at(key)).ok());
    static_cast<void>(global.step(1000));
    const double now = global.query(watched).evidence;
    seen += now != evidence ? 1U : 0U;
    evidence = now;
  }
  CAPTURE(version, seen);
  CHECK(global.generation() == 1);
  CHECK(seen >= 20);
}

TEST_CASE("fusion: a slot that is empty takes nothing and has nothing to remove") {
  Random random(announce_seed(79));
  Team team(team_config());
  OracleContribution contribution;
  contribution.voxels = random_voxels(random, 60, {0, 0, 0});
  team.publish(contribution, 1);
  team.settle();
  GlobalMap& global = team.global();
  global.remove(0);
  team.settle();
  CHECK(global.put(0, BlockKey{1}, 9, {}).status() == Status::kInvalidArgument);
  CHECK(global.set_frame(0, GridTransform(), 9) == Replicas::Change::kStale);
  global.remove(0);
  CHECK_FALSE(global.busy());
  CHECK(global.replicas().usage().contributions == 0);
  CHECK(global.replicas().usage().replica_blocks == 0);
}

TEST_CASE("fusion: a robot that is removed while its move is marked leaves once") {
  Random random(announce_seed(80));
  Team team(team_config());
  OracleContribution contribution;
  contribution.voxels = random_voxels(random, 200, {0, 0, 0});
  team.publish(contribution, 1);
  team.settle();
  GlobalMap& global = team.global();
  const GridTransform frame = *GridTransform::make(random_transform(random, 20.0, 0.4), 0.1);
  REQUIRE(global.set_frame(0, frame, 1) == Replicas::Change::kTaken);
  static_cast<void>(global.step(60));
  const bool queued = GENERATE(false, true);
  if (queued) REQUIRE(global.set_frame(0, GridTransform(), 2) == Replicas::Change::kTaken);
  global.remove(0);
  team.settle();
  CHECK(global.generation() == 1);
  CHECK(global.replicas().usage().contributions == 0);
  CHECK(global.map().block_count() == 0);
}

}  // namespace
}  // namespace tessera::oracle
