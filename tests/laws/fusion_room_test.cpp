// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What leaves gives its room back, and what found none takes it.
#include <catch2/catch.hpp>

#include "support/team.hpp"

namespace tessera::oracle {
namespace {

TEST_CASE("fusion: what had no room is there once something elsewhere that left has made some") {
  Random random(announce_seed(82));
  GlobalMapConfig config = team_config();
  OracleContribution first;
  first.id = {1, 1, 0};
  first.voxels = random_voxels(random, 1500, {0, 0, 0});
  OracleContribution second;
  second.id = {2, 1, 0};
  second.voxels = random_voxels(random, 1500, {800, 800, 0});
  Team alone(config);
  alone.publish(second, 1);
  alone.settle();
  config.map.storage_bytes =
      (alone.global().map().usage().used_bytes / SlabPool::kPageBytes + 8) * SlabPool::kPageBytes;
  Team team(config);
  team.publish(first, 1);
  team.settle();
  team.publish(second, 1);
  team.settle();
  REQUIRE(team.global().report().refused_outputs > 0);
  REQUIRE(team.digest() != alone.digest());
  team.global().remove(*team.global().replicas().find(first.id));
  team.settle();
  CHECK(team.digest() == alone.digest());
}

/// Contributions that are turned take more blocks than before. Another one far away has the room
/// for these: once it has left, all is as if it had never been there.
void check_room_after_move(GlobalMapConfig config, Random& random,
                           const std::vector<OracleContribution>& turned) {
  OracleContribution far;
  far.id = {1, 1, 0};
  far.voxels = random_voxels(random, 1500, {0, 0, 0});
  const GridTransform frame = *GridTransform::make(random_transform(random, 10.0, 0.3), 0.1);
  const auto publish = [&](Team& team, bool with_far) {
    if (with_far) team.publish(far, 1);
    for (const OracleContribution& one : turned) team.publish(one, 1);
    team.settle();
  };
  const auto turn = [&](Team& team) {
    GlobalMap& global = team.global();
    for (const OracleContribution& one : turned)
      static_cast<void>(global.set_frame(*global.replicas().find(one.id), frame, 1));
    team.settle();
  };
  Team alone(config);
  publish(alone, false);
  turn(alone);
  Team ample(config);
  publish(ample, true);
  config.map.storage_bytes =
      (ample.global().map().usage().used_bytes / SlabPool::kPageBytes + 1) * SlabPool::kPageBytes;
  Team team(config);
  publish(team, true);
  REQUIRE(team.global().report().refused_outputs == 0);
  turn(team);
  REQUIRE(team.global().report().refused_outputs > 0);
  REQUIRE(team.global().report().torn_blocks == 0);
  REQUIRE(team.digest() != alone.digest());
  team.global().remove(*team.global().replicas().find(far.id));
  team.settle();
  CHECK(team.digest() == alone.digest());
}

TEST_CASE("fusion: what had no room after a move is there once something has left") {
  Random random(announce_seed(84));
  OracleContribution one;
  one.id = {2, 1, 0};
  one.voxels = random_voxels(random, 1500, {800, 800, 0});
  check_room_after_move(team_config(), random, {one});
}

TEST_CASE("fusion: so is what two robots see, and is diffused") {
  Random random(announce_seed(85));
  const GlobalMapConfig config = team_config();
  REQUIRE(config.diffusion.mode == DiffusionMode::kContractive);
  OracleContribution one;
  one.id = {2, 1, 0};
  one.voxels = random_voxels(random, 1200, {800, 800, 0});
  OracleContribution other;
  other.id = {3, 1, 0};
  other.voxels = random_voxels(random, 1200, {800, 800, 0});
  check_room_after_move(config, random, {one, other});
}

TEST_CASE("fusion: a contribution without blocks leaves at once, also while others move") {
  Random random(announce_seed(83));
  Team team(team_config());
  OracleContribution other;
  other.id = {1, 1, 0};
  other.voxels = random_voxels(random, 200, {0, 0, 0});
  team.publish(other, 1);
  GlobalMap& global = team.global();
  const ContributionId id{2, 1, 0};
  const GlobalMap::Slot slot = *global.open(id, GridTransform());
  const GridTransform moved = *GridTransform::make(random_transform(random, 10.0, 0.3), 0.1);
  static_cast<void>(global.set_frame(*global.replicas().find(other.id), moved, 1));
  static_cast<void>(global.set_frame(slot, moved, 1));
  global.remove(slot);
  CHECK_FALSE(global.replicas().find(id).ok());
  team.settle();
  // One whose move is under way leaves with it.
  const GlobalMap::Slot again = *global.open(id, GridTransform());
  static_cast<void>(global.set_frame(again, moved, 1));
  static_cast<void>(global.step(1));
  global.remove(again);
  team.settle();
  CHECK_FALSE(global.replicas().find(id).ok());
  CHECK(global.replicas().in_order().size() == 1);
}

}  // namespace
}  // namespace tessera::oracle
