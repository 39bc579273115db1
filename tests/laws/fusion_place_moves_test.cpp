// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Moves of robots' worlds: seen before or after, and no work where nothing moves.
#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/cloud.hpp"
#include "support/placed_robots.hpp"
#include "tessera/fusion/global_reader.hpp"

namespace tessera::oracle {
namespace {

/// Every voxel that either map has, as a reader sees it.
using View = std::vector<std::pair<float, int>>;
View view_of(GlobalReader& reader, const std::vector<VoxelCoord>& voxels) {
  std::vector<Estimate> found(voxels.size());
  REQUIRE(reader.query(voxels, found) == Status::kOk);
  View view;
  for (const Estimate& one : found) view.emplace_back(one.evidence, one.label);
  return view;
}

OracleContribution random_contribution(Random& random, std::uint32_t robot, int voxels) {
  OracleContribution one;
  one.id = {robot, 1, 0};
  one.T_global_local = random_transform(random, 20.0, 0.3);
  one.voxels = random_voxels(random, voxels, {0, 0, 0});
  return one;
}

}  // namespace

TEST_CASE("places: moves of robots and of one contribution are seen together, before or after") {
  Random random(announce_seed(8102));
  const bool appears = GENERATE(true, false);
  const std::uint64_t budget = GENERATE(40U, 300U);
  Team team(places_config(true));
  GlobalMap& global = team.global();
  std::vector<OracleContribution> all;
  for (std::uint32_t robot = 0; robot < 3; ++robot) {
    all.push_back(random_contribution(random, robot, 150));
    team.publish(all.back(), 1);
    if (robot != 2 || !appears) REQUIRE(global.place(robot, Matrix34d::Identity()).ok());
  }
  Objection objection{.against = all[0].id, .version = 1};
  for (std::uint64_t& slice : objection.voxels) slice = ~0ULL;
  std::array<std::byte, Objection::kMostBytes> bytes{};
  const GlobalMap::Slot objects = *global.open({2, 1, Objection::kNumber}, GridTransform());
  for (const auto& [key, block] : pack_voxels(all[0].voxels)) {
    objection.key = BlockKey{key};
    const std::size_t size = objection.write(bytes);
    REQUIRE(global
                .put(objects, Objection::place_of(objection.against, objection.key), 1,
                     std::span(bytes).first(size))
                .ok());
  }
  team.settle();
  // One robot's world moves, with a frame of its own in it; another comes or goes.
  const Matrix34d T_team_world = random_transform(random, 15.0, 0.4);
  const Matrix34d T_world_local = random_transform(random, 25.0, 0.5);
  const std::optional<Matrix34d> of_last =
      appears ? std::optional(random_transform(random, 15.0, 0.4)) : std::nullopt;
  const auto move = [&](GlobalMap& map, bool frame_first) {
    const GlobalMap::Slot slot = *map.replicas().find(all[1].id);
    if (!frame_first) REQUIRE(map.place(1, T_team_world).ok());
    REQUIRE(map.set_frame(slot, grid_of(T_world_local), 2) == Replicas::Change::kTaken);
    if (frame_first) REQUIRE(map.place(1, T_team_world).ok());
    REQUIRE(map.place(2, of_last).ok());
  };
  const auto voxels_in = [](const GlobalMap& map, std::vector<VoxelCoord>& into) {
    for (const auto& [voxel, counts] : voxels_of(map.map())) into.push_back(coord_of(voxel));
  };
  std::vector<VoxelCoord> voxels;
  voxels_in(global, voxels);
  Said said;
  for (const OracleContribution& one : all) {
    Said::One& of = said.contributions[one.id];
    of.T_world_local = one.id.robot == 1 ? T_world_local : one.T_global_local;
    for (const auto& [key, packed] : pack_voxels(one.voxels)) of.blocks[key] = {1, packed};
  }
  said.places = {{0, Matrix34d::Identity()}, {1, T_team_world}};
  if (of_last) said.places[2] = *of_last;
  for (const Replicas::Slot slot : {objects}) {
    Said::One& of = said.contributions[{2, 1, Objection::kNumber}];
    const Replicas& replicas = global.replicas();
    for (std::uint32_t at = replicas.contribution(slot).first_block; at != 0;) {
      const Replicas::Replica& record = replicas.record(at);
      std::vector<std::byte> packed(record.bytes);
      static_cast<void>(replicas.read(record, packed));
      of.blocks[record.key] = {record.version, packed};
      at = record.next;
    }
  }
  Team after(places_config(false));
  said.fuse(after);
  voxels_in(after.global(), voxels);

  GlobalReader reader(global);
  GlobalReader reader_after(after.global());
  const View seen_before = view_of(reader, voxels);
  const View seen_after = view_of(reader_after, voxels);
  REQUIRE(seen_before != seen_after);
  const std::uint64_t generation = global.generation();
  move(global, GENERATE(true, false));
  int steps_before = 0;
  while (global.busy()) {
    global.step(budget);
    const View seen = view_of(reader, voxels);
    if (reader.generation() == generation) {
      ++steps_before;
      REQUIRE(seen == seen_before);
    } else {
      REQUIRE(seen == seen_after);
    }
  }
  CHECK(steps_before > 5);
  CHECK(global.generation() == generation + 1);  // all of it was one move
  CHECK(global.report().torn_blocks == 0);
  CHECK(team.digest() == after.digest());
}

TEST_CASE("places: what a robot objects to while it gets its place is shown with that") {
  Random random(announce_seed(8106));
  const int steps = GENERATE(0, 1, 3, 13, 32, 34, 35, 36, 37, 38, 40, 42);
  const OracleContribution one = random_contribution(random, 0, 120);
  const PackedBlocks blocks = pack_voxels(one.voxels);
  const auto by_size = [](const auto& a, const auto& b) {
    return a.second.size() < b.second.size();
  };
  const std::uint64_t early = std::min_element(blocks.begin(), blocks.end(), by_size)->first;
  const std::uint64_t late = std::max_element(blocks.begin(), blocks.end(), by_size)->first;
  const auto object = [&](Team& team, std::uint64_t key) {
    Objection objection{.against = one.id, .key = BlockKey{key}, .version = 1};
    for (std::uint64_t& slice : objection.voxels) slice = ~0ULL;
    std::array<std::byte, Objection::kMostBytes> bytes{};
    const std::span<const std::byte> packed = std::span(bytes).first(objection.write(bytes));
    const GlobalMap::Slot slot = *team.global().open({2, 1, Objection::kNumber}, GridTransform());
    const BlockKey place = Objection::place_of(one.id, objection.key);
    REQUIRE(team.global().put(slot, place, {.number = 1, .first = 1}, packed).ok());
  };
  Team team(places_config(true));
  GlobalMap& global = team.global();
  // Nothing has moved before, so that nothing is staged that need not be.
  REQUIRE(global.place(0, Matrix34d::Identity()).ok());
  static_cast<void>(global.step(1));
  team.publish(one, 1);
  object(team, early);
  team.settle();
  std::vector<VoxelCoord> voxels;
  for (const auto& [voxel, counts] : voxels_of(global.map())) voxels.push_back(coord_of(voxel));
  GlobalReader reader(global);
  const View before = view_of(reader, voxels);
  const std::uint64_t generation = global.generation();

  // Before, while and after what it objects to is marked; what comes late is brought up to date
  // first.
  global.set_focus(unpack(BlockKey{late}));
  REQUIRE(global.place(2, Matrix34d::Identity()).ok());
  for (int i = 0; i < steps; ++i) global.step(1);
  object(team, late);
  while (global.busy()) {
    if (global.generation() == generation) REQUIRE(view_of(reader, voxels) == before);
    global.step(20);
  }
  CHECK(global.generation() == generation + 1);
  Team anew(places_config(false));
  anew.publish(one, 1);
  object(anew, early);
  object(anew, late);
  anew.settle();
  CHECK(team.digest() == anew.digest());
  CHECK(global.report().objected_voxels == anew.global().report().objected_voxels);
  CHECK(global.report().objected_voxels > 0);
}

TEST_CASE("places: a robot without a place costs no work, and is there at once when it has one") {
  Random random(announce_seed(8103));
  Team team(places_config(true));
  GlobalMap& global = team.global();
  const OracleContribution one = random_contribution(random, 5, 200);
  team.publish(one, 1);
  const GlobalMap::Slot slot = *global.replicas().find(one.id);
  REQUIRE(global.set_frame(slot, grid_of(shift_of(0.7)), 3) == Replicas::Change::kTaken);
  const std::uint64_t generation = global.generation();
  CHECK(global.step(1U << 20U) == 0);
  CHECK_FALSE(global.busy());
  CHECK(global.generation() == generation);
  CHECK(global.report().blocks == 0);
  CHECK(global.map().block_count() == 0);
  CHECK(global.reliability(5).status() == Status::kOutOfRange);
  CHECK(global.replicas().contribution(slot).blocks > 0);
  CHECK(global.replicas().contribution(slot).frame_revision == 3);
  CHECK(global.replicas().contribution(slot).T_world_local == grid_of(shift_of(0.7)));
  // Neither does one whose place is out of the grid.
  REQUIRE(global.place(5, shift_of(kEdgeOfGrid_m)).ok());
  CHECK(global.step(1U << 20U) == 0);
  CHECK(global.report().out_of_grid == 1);
  CHECK(global.report().blocks == 0);

  REQUIRE(*global.place(5, Matrix34d::Identity()) == Replicas::Change::kTaken);
  team.settle();
  CHECK(global.report().out_of_grid == 0);
  Team as_given(places_config(false));
  OracleContribution moved = one;
  moved.T_global_local = shift_of(0.7);
  as_given.publish(moved, 1);
  as_given.settle();
  CHECK(team.digest() == as_given.digest());
  CHECK(global.reliability(5).ok());
}

TEST_CASE("places: where nothing moves nothing is done, and the frames' stamps stay") {
  Random random(announce_seed(8104));
  Team team(places_config(true));
  GlobalMap& global = team.global();
  const Matrix34d T = random_transform(random, 15.0, 0.4);
  // A place may be known before anything is heard of the robot.
  REQUIRE(*global.place(1, T) == Replicas::Change::kTaken);
  CHECK(global.step(1U << 20U) == 0);
  CHECK(global.generation() == 0);
  const OracleContribution one = random_contribution(random, 1, 100);
  team.publish(one, 1);
  team.settle();
  const GlobalMap::Slot slot = *global.replicas().find(one.id);
  const FrameStamp stamp = global.replicas().contribution(slot).frame();
  CHECK(*global.place(1, T) == Replicas::Change::kStale);
  CHECK_FALSE(global.busy());
  // There and back before it began.
  REQUIRE(*global.place(1, shift_of(1.0)) == Replicas::Change::kTaken);
  REQUIRE(*global.place(1, T) == Replicas::Change::kTaken);
  CHECK(global.step(1U << 20U) == 0);
  CHECK_FALSE(global.busy());
  CHECK(global.generation() == 0);
  CHECK(global.replicas().contribution(slot).frame() == stamp);
  // A robot that others object to must notice that it moved.
  REQUIRE(*global.place(1, shift_of(1.0)) == Replicas::Change::kTaken);
  team.settle();
  CHECK(global.generation() == 1);
  CHECK_FALSE(global.replicas().contribution(slot).frame() == stamp);
}

TEST_CASE("places: are refused where they are of no use, or too many") {
  Matrix34d elsewhere = Matrix34d::Identity();
  elsewhere(0, 3) = 0.1;
  Team given(places_config(false));
  CHECK(given.global().place(1, elsewhere).status() == Status::kInvalidArgument);
  Team team(places_config(true));
  GlobalMap& global = team.global();
  Matrix34d skewed = Matrix34d::Identity();
  skewed(0, 1) = 0.5;
  CHECK(global.place(1, skewed).status() == Status::kInvalidArgument);
  for (std::uint32_t robot = 0; robot < Replicas::kMostRobots; ++robot)
    REQUIRE(global.place(robot, Matrix34d::Identity()).ok());
  CHECK(global.place(64, Matrix34d::Identity()).status() == Status::kResourceExhausted);
  CHECK(*global.place(64, std::nullopt) == Replicas::Change::kStale);
  REQUIRE(global.place(7, std::nullopt).ok());
  team.settle();
  CHECK(global.place(64, Matrix34d::Identity()).ok());
}

TEST_CASE("places: a block that had no room is tried again once other robots have no place") {
  Random random(announce_seed(8105));
  std::vector<OracleContribution> all;
  for (std::uint32_t robot = 0; robot < 4; ++robot) {
    all.push_back(random_contribution(random, robot, 200));
    all.back().T_global_local = shift_of(robot < 2 ? 0.0 : 40.0);
  }
  GlobalMapConfig config = places_config(true);
  const auto fuse_two = [&](Team& team, std::size_t first) {
    for (std::size_t i = first; i < first + 2; ++i) {
      team.publish(all[i], 1);
      if (team.global().config().place_robots)
        REQUIRE(team.global().place(all[i].id.robot, Matrix34d::Identity()).ok());
    }
    team.settle();
  };
  // Room for the sums of two robots that meet, not for those of two more.
  Team first_two(places_config(false));
  Team last_two(places_config(false));
  fuse_two(first_two, 0);
  fuse_two(last_two, 2);
  const std::size_t bytes =
      std::max(first_two.global().report().sum_bytes, last_two.global().report().sum_bytes);
  config.sum_segments = static_cast<std::uint32_t>(bytes / SegmentStore::kSegmentBytes) + 8;
  Team team(config);
  fuse_two(team, 0);
  REQUIRE(team.global().report().refused_sums == 0);
  fuse_two(team, 2);
  REQUIRE(team.global().report().refused_sums > 0);
  for (const std::uint32_t robot : {0U, 1U}) REQUIRE(team.global().place(robot, std::nullopt).ok());
  team.settle();
  CHECK(team.digest() == last_two.digest());
}

}  // namespace tessera::oracle
