// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One thread moves contributions to and fro and takes updates, while others read the global map.
#include "tessera/fusion/global_reader.hpp"

#include <vector>

#include "race.hpp"
#include "support/team.hpp"

namespace tessera {
namespace {

using oracle::OracleContribution;
using oracle::OracleCounts;
using oracle::Voxel;

/// As far as the robot moves: blocks that it leaves are none of those that it comes to.
constexpr std::int64_t kMove = 64;
constexpr int kWatched = 40;

OracleCounts counts_of(int label, double count) {
  OracleCounts counts(oracle::kTeamClasses + 2);
  counts[static_cast<std::size_t>(label)] = count;
  return counts;
}

/// Where the moving robot has labels before its first move; the other one has none there, but close
/// by, so that both are part of the graph.
Voxel watched(int i) { return {(7 * i) % 40, 3 * (i % 11), (5 * i) % 17}; }

OracleContribution mover() {
  OracleContribution contribution;
  contribution.id = {1, 0, 0};
  for (int i = 0; i < kWatched; ++i) contribution.voxels[watched(i)] = counts_of(2, 3.0);
  return contribution;
}

OracleContribution stayer(int round) {
  OracleContribution contribution;
  for (int i = 0; i < kWatched; ++i) {
    for (const std::int64_t shift : {std::int64_t{0}, kMove}) {
      Voxel voxel = watched(i);
      voxel[0] += shift;
      voxel[1] += 1;
      if (i % 7 != round % 7) contribution.voxels[voxel] = counts_of(1, 1.0 + round % 3);
    }
  }
  // Nobody stays where the other is watched.
  for (int i = 0; i < kWatched; ++i) {
    for (const std::int64_t shift : {std::int64_t{0}, kMove}) {
      Voxel voxel = watched(i);
      voxel[0] += shift;
      contribution.voxels.erase(voxel);
    }
  }
  return contribution;
}

/// Some of the places that the robot is seen at before and after, all at once.
void read_some(GlobalReader& reader, oracle::Random& random, std::uint64_t& last,
               Findings& findings) {
  constexpr std::size_t kAtOnce = 6;
  std::array<VoxelCoord, 2 * kAtOnce> voxels;
  std::array<Estimate, 2 * kAtOnce> found;
  for (std::size_t i = 0; i < kAtOnce; ++i) {
    Voxel voxel = watched(random.below(kWatched));
    voxels[2 * i] = oracle::coord_of(voxel);
    voxel[0] += kMove;
    voxels[2 * i + 1] = oracle::coord_of(voxel);
  }
  if (reader.query(voxels, found) != Status::kOk) return;
  const std::uint64_t generation = reader.generation();
  bool whole = generation >= last;
  last = generation;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool there = found[i].state == VoxelState::kOccupied;
    whole = whole && there == (i % 2 == generation % 2);
    findings.full += there ? 1U : 0U;
  }
  findings.torn += whole ? 0U : 1U;
}

}  // namespace

TEST_CASE("global reader: a robot that moves is seen before or after, never in part") {
  GlobalMapConfig config =
      oracle::team_config(GENERATE(TuplePolicy::kDense, TuplePolicy::kCompact));
  config.diffusion.iterations = 2;
  oracle::Team team(config);
  GlobalMap& global = team.global();
  team.publish(stayer(0), 1);
  team.publish(mover(), 1);
  team.settle();
  const GlobalMap::Slot slot = *global.replicas().find(mover().id);
  Matrix34d away = Matrix34d::Identity();
  away(0, 3) = static_cast<double>(kMove) * config.map.resolution_m;
  Findings findings;
  race<GlobalReader>(
      global, findings, kVoxelReads / 10,
      [&](int round) {
        const GridTransform frame = *GridTransform::make(
            round % 2 == 0 ? away : Matrix34d(Matrix34d::Identity()), config.map.resolution_m);
        const auto revision = static_cast<std::uint32_t>(round) + 1;
        REQUIRE(global.set_frame(slot, frame, revision) == Replicas::Change::kTaken);
        team.publish(stayer(round), revision + 1);
        while (global.busy()) global.step(400);
      },
      [&](GlobalReader& reader, oracle::Random& random) {
        thread_local std::uint64_t last = 0;
        read_some(reader, random, last, findings);
      });
  CHECK(global.report().torn_blocks == 0);
  CHECK(global.generation() >= 48);
  CHECK(global.report().nodes > 0);
}

TEST_CASE("global reader: asks as the thread that works does") {
  oracle::Team team(oracle::team_config());
  oracle::Random random(91);
  static_cast<void>(oracle::publish_random(team, random, 2, 100));
  GlobalReader reader(team.global());
  for (const auto& [voxel, counts] : oracle::voxels_of(team.global().map())) {
    const Estimate own = team.global().query(oracle::coord_of(voxel));
    const Result<Estimate> read = reader.query(oracle::coord_of(voxel));
    REQUIRE(read.ok());
    CHECK((read->label == own.label && read->evidence == own.evidence));
  }
  CHECK(reader.query(VoxelCoord{5000, 0, 0})->state == VoxelState::kUnknown);
  CHECK(reader.query(Point3f(1e30F, 0.0F, 0.0F))->state == VoxelState::kUnknown);
  std::array<VoxelCoord, 2> voxels{};
  std::array<Estimate, 1> short_of_one{};
  CHECK(reader.query(voxels, short_of_one) == Status::kInvalidArgument);
  CHECK(reader.generation() == 0);
  CHECK(reader.busy() == 0);
  CHECK(reader.retries() == 0);
}

TEST_CASE("global reader: a block is what its voxels are, also in the middle of a move") {
  oracle::Team team(oracle::team_config());
  GlobalMap& global = team.global();
  team.publish(stayer(0), 1);
  team.publish(mover(), 1);
  team.settle();
  GlobalReader reader(global);
  std::vector<std::uint64_t> words(reader.snapshot_bytes() / 8 + 1);
  const std::span<std::byte> workspace = std::as_writable_bytes(std::span(words));
  Matrix34d away = Matrix34d::Identity();
  away(0, 3) = static_cast<double>(kMove) * global.map().config().resolution_m;
  const GridTransform frame = *GridTransform::make(away, global.map().config().resolution_m);
  REQUIRE(global.set_frame(*global.replicas().find(mover().id), frame, 1) ==
          Replicas::Change::kTaken);
  int steps = 0;
  int occupied = 0;
  for (bool busy = true; busy; ++steps) {
    busy = global.busy();
    for (int i = 0; i < 2 * kWatched; ++i) {
      Voxel voxel = watched(i / 2);
      voxel[0] += i % 2 == 0 ? 0 : kMove;
      const VoxelCoord at = oracle::coord_of(voxel);
      const Result<BlockSnapshot> block = reader.snapshot(block_of(at), workspace);
      REQUIRE(block.ok());
      const Estimate of_block =
          block->empty() ? Estimate{}
                         : estimate(block->evidence(octet_in_block(at), voxel_in_octet(at)),
                                    global.map().reading());
      const Result<Estimate> of_voxel = reader.query(at);
      REQUIRE(of_voxel.ok());
      CHECK(of_block.state == of_voxel->state);
      CHECK(of_block.label == of_voxel->label);
      CHECK(of_block.evidence == of_voxel->evidence);
      occupied += of_voxel->state == VoxelState::kOccupied ? 1 : 0;
    }
    if (busy) global.step(50);
  }
  CHECK(steps > 4);
  CHECK(occupied >= steps * kWatched);
  CHECK(reader.snapshot({kBlockLimit, 0, 0}, workspace).status() == Status::kOutOfRange);
  CHECK(reader.snapshot({0, 0, 0}, workspace.first(100)).status() == Status::kInvalidArgument);
}

}  // namespace tessera
