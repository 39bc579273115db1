// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one robot may say: no more than its map's cap, of each voxel once however often it began
// anew; and when it goes, all that it took comes back.
#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"
#include "tessera/exchange/internal/block_codec.hpp"

namespace tessera::oracle {
namespace {

constexpr double kLevel127 = 786432.0;  // The largest count that the wire can say.
constexpr std::int64_t kWall = 16;      // Voxels on an edge.

/// A wall of one class, each of its voxels with so much evidence and so many passes.
OracleVoxels wall(int label, double count, double passes) {
  OracleVoxels voxels;
  for (std::int64_t y = 0; y < kWall; ++y) {
    for (std::int64_t z = 0; z < kWall; ++z) {
      OracleCounts counts(kTeamClasses + 2);
      counts[0] = passes;
      if (label != 0) counts[static_cast<std::size_t>(label)] = count;
      voxels[{3, y, z}] = counts;
    }
  }
  return voxels;
}

TEST_CASE("fusion: one robot overrules two only as far as its map's cap goes") {
  GlobalMapConfig config = team_config();
  config.max_evidence = GENERATE(100.0F, 0.0F);
  config.map.free_weight = 2.0F;
  config.diffusion.mode = GENERATE(DiffusionMode::kNone, DiffusionMode::kContractive);
  const std::uint32_t forger = GENERATE(0U, 9U);
  const double cap = config.max_evidence > 0.0F ? 100.0 : 250.0;
  Team team(config);
  for (const std::uint32_t robot : {2U, 3U}) {
    OracleContribution honest;
    honest.id = {robot, 0, 0};
    honest.voxels = wall(1, 0.75 * cap, 0.0);
    team.publish(honest, 1);
  }
  OracleContribution forged;
  forged.voxels = wall(4, kLevel127, 224.0);
  // A name for each epoch and submap makes no more of it.
  for (const std::uint32_t epoch : {0U, 1U}) {
    for (const std::uint32_t submap : {0U, 1U, 2U}) {
      forged.id = {forger, epoch, submap};
      team.publish(forged, 1);
    }
  }
  team.settle();
  const OracleVoxels found = voxels_of(team.global().map());
  REQUIRE(found.size() == static_cast<std::size_t>(kWall * kWall));
  for (const auto& [voxel, counts] : found) {
    CHECK(counts[1] == Approx(1.5 * cap));
    CHECK(counts[4] == Approx(cap));
    CHECK(counts[0] == cap / 2.0);
    CHECK(team.global().query(coord_of(voxel)).label == 1);
  }
}

/// Of random voxels, what a map with this cap may hold of them, rounded to what the wire says.
PackedBlocks publish_under_cap(Random& random, float cap, float free_weight) {
  AlignedMemory memory(BlockContent::required_bytes(kTeamClasses + 2));
  Arena arena(memory.span());
  BlockContent content = *BlockContent::make(arena, kTeamClasses + 2);
  std::vector<std::byte> bytes(most_packed_bytes(kTeamClasses + 2));
  PackedBlocks packed;
  for (std::int32_t x = 0; x < 6; ++x) {
    content.clear();
    for (int row = 0; row < kBlockVoxels; ++row) {
      const int most = passes_at_cap(cap, free_weight);
      if (random.below(3) == 0)
        content.add_passes(row, 1U + static_cast<unsigned>(random.below(most)));
      // Up to the last bit of the cap.
      float room = cap * static_cast<float>(1.0 - 0.3 * random.uniform() * random.below(2));
      for (int parts = random.below(5); parts > 0; --parts) {
        const float part = parts == 1 ? room : room * static_cast<float>(random.uniform());
        content.add(1 + random.below(kTeamClasses + 1), row, part);
        room -= part;
      }
    }
    quantise(content);
    const std::size_t size = pack_block(content, bytes);
    const std::uint64_t key = pack_in_grid({x, 0, 0}).bits;
    packed[key].assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return packed;
}

TEST_CASE("fusion: what a robot's map holds under its cap, rounded by the wire, is not changed") {
  Random random(announce_seed(82));
  const float cap = GENERATE(100.0F, 250.0F, 0.4F, 7.3F, 33.3F);
  GlobalMapConfig config = team_config();
  config.map.free_weight = cap < 1.0F ? cap : cap / 97.0F;
  GlobalMapConfig without = config;
  config.max_evidence = cap;
  without.max_evidence = 1e6F;
  Team capped(config);
  Team free(without);
  for (std::uint32_t robot = 0; robot < 3; ++robot) {
    for (const auto& [key, bytes] : publish_under_cap(random, cap, config.map.free_weight)) {
      for (Team* const team : {&capped, &free}) {
        const GlobalMap::Slot slot = *team->global().open({robot, 0, 0}, GridTransform());
        REQUIRE(team->global().put(slot, BlockKey{key}, 1, bytes).ok());
      }
    }
  }
  capped.settle();
  free.settle();
  CHECK(capped.digest() == free.digest());
  CHECK(capped.global().map().usage().label_voxels > 1000);
}

TEST_CASE("fusion: a cap that is no number of evidence is refused") {
  GlobalMapConfig config = team_config();
  config.max_evidence = GENERATE(-1.0F, 2e6F, std::numeric_limits<float>::quiet_NaN());
  AlignedMemory memory(GlobalMap::required_bytes(config, kTeamClasses + 2));
  Arena arena(memory.span());
  CHECK(GlobalMap::make(arena, config, numbered_classes(kTeamClasses)).status() ==
        Status::kInvalidArgument);
}

TEST_CASE("fusion: a block that comes in parts adds up in one order, however they came") {
  // Sums of such counts hang on their order, and a turn puts voxels of several layers into one.
  Random random(announce_seed(83));
  GlobalMapConfig config = team_config();
  config.max_evidence = 1e6F;
  config.diffusion.mode = DiffusionMode::kNone;
  const Matrix34d T = random_transform(random, 35.0, 0.5);
  std::array<OracleVoxels, kBlockLayers> of_layers;
  for (std::int64_t i = 0; i < kBlockVoxels; ++i) {
    OracleCounts counts(kTeamClasses + 2);
    counts[1] = (1.0 + random.below(60000)) * (random.below(2) == 0 ? 0x1p-20 : 1.0);
    const Voxel voxel{i % 8, i / 8 % 8, i / 64};
    of_layers[layer_of_row(row_order(coord_of(voxel)))][voxel] = counts;
  }
  OracleContribution other;
  for (std::int64_t i = 0; i < 24 * 24 * 24; ++i) {
    OracleCounts counts(kTeamClasses + 2);
    counts[1] = 0x1.8p-9 * (1.0 + random.below(60000));
    other.voxels[{i % 24 - 8, i / 24 % 24 - 8, i / 576 - 8}] = counts;
  }
  const auto digest_of = [&](const std::array<std::uint32_t, kBlockLayers>& order) {
    Team team(config);
    team.publish(other, 1);
    const GlobalMap::Slot slot = *team.global().open({1, 0, 0}, *GridTransform::make(T, 0.1));
    for (const std::uint32_t layer : order) {
      const PackedBlocks packed = pack_voxels(of_layers[layer]);
      const PartVersion version{
          .number = 1 + layer, .first = 1, .layers = static_cast<std::uint8_t>(1U << layer)};
      REQUIRE(team.global()
                  .put(slot, BlockKey{packed.begin()->first}, version, packed.begin()->second)
                  .ok());
    }
    team.settle();
    return team.digest();
  };
  std::array<std::uint32_t, kBlockLayers> order{0, 1, 2, 3};
  const std::uint64_t expected = digest_of(order);
  while (std::next_permutation(order.begin(), order.end())) CHECK(digest_of(order) == expected);
}

/// What a contribution takes: all of it must come back.
std::vector<std::uint64_t> taken(const GlobalMap& global) {
  const GlobalMapReport report = global.report();
  const MapUsage map = global.map().usage();
  return {report.blocks,
          report.sum_bytes,
          report.overlap_blocks,
          report.nodes,
          report.waiting,
          report.replicas.contributions,
          report.replicas.replica_blocks,
          report.replicas.segments,
          map.label_voxels,
          global.map().block_count(),
          global.map().count_free_voxels(),
          global.replicas().in_order().size()};
}

TEST_CASE("fusion: what is removed gives back all that it took, whatever came between") {
  Random random(announce_seed(84));
  GlobalMapConfig config = team_config(GENERATE(TuplePolicy::kCompact, TuplePolicy::kDense));
  config.replicas.contributions = 6;
  Team team(config);
  static_cast<void>(publish_random(team, random, 3, 250));
  GlobalMap& global = team.global();
  const std::vector<std::uint64_t> before = taken(global);
  const std::uint64_t digest_before = team.digest();
  for (int round = 0; round < 12; ++round) {
    // One more epoch of a robot that is there, and a robot that is not.
    for (const std::uint32_t robot : {1U, 7U}) {
      for (std::uint32_t epoch = 1; epoch < (robot == 1 ? 2U : 3U); ++epoch) {
        OracleContribution more;
        more.id = {robot, epoch, static_cast<std::uint32_t>(round)};
        more.T_global_local = random_transform(random, 20.0, 0.5);
        more.voxels = random_voxels(random, 200, {0, 0, 0});
        team.publish(more, 1);
      }
    }
    // No place is left for a seventh, nor lost by asking for one.
    CHECK(global.open({8, 0, 0}, GridTransform()).status() == Status::kResourceExhausted);
    if (random.below(3) != 0) team.settle();
    const GlobalMap::Slot of_one =
        *global.replicas().find({1, 1, static_cast<std::uint32_t>(round)});
    if (random.below(2) == 0)
      static_cast<void>(global.set_frame(
          of_one, *GridTransform::make(random_transform(random, 9.0, 0.2), 0.1), 1));
    static_cast<void>(global.step(static_cast<std::uint64_t>(random.below(30000))));
    CHECK_FALSE(global.leaving(of_one));
    global.remove(of_one);
    CHECK(global.leaving(of_one));
    global.remove_before(7, 9);
    const auto budget = static_cast<std::uint64_t>(1 + random.below(5000));
    while (global.busy()) static_cast<void>(global.step(budget));
    CHECK_FALSE(global.leaving(of_one));
    REQUIRE(taken(global) == before);
    REQUIRE(team.digest() == digest_before);
  }
}

TEST_CASE("fusion: a robot that began a thousand times counts once, and takes four places") {
  Random random(announce_seed(85));
  GlobalMapConfig config = team_config();
  config.replicas.contributions = 5;
  Team team(config);
  GlobalMap& global = team.global();
  OracleContribution other;
  other.id = {9, 0, 0};
  other.voxels = random_voxels(random, 120, {0, 0, 0});
  team.publish(other, 1);
  constexpr std::uint32_t kStarts = 1000;
  constexpr std::uint32_t kPlaces = 4;
  std::vector<OracleContribution> epochs;
  for (std::uint32_t epoch = 1; epoch <= kStarts; ++epoch) {
    OracleContribution& now = epochs.emplace_back();
    now.id = {3, epoch, 0};
    now.T_global_local = random_transform(random, 5.0, 0.1);
    now.voxels = random_voxels(random, epoch > kStarts - 2 ? 1500 : 40, {0, 0, 0});
    if (epoch > kPlaces) {
      global.remove_before(3, epoch - kPlaces + 1);
      team.settle();
    }
    team.publish(now, 1);
    static_cast<void>(global.step(static_cast<std::uint64_t>(random.below(3000))));
    REQUIRE(global.replicas().usage().contributions <= kPlaces + 1);
  }
  team.settle();
  // As those that are left alone, in whatever order.
  Team anew(config);
  for (std::size_t i = kStarts; i > kStarts - kPlaces; --i) anew.publish(epochs[i - 1], 1);
  anew.publish(other, 1);
  anew.settle();
  CHECK(team.digest() == anew.digest());
  // The newest, and of the one before what the newest does not cover: as one map of both.
  global.remove_before(3, kStarts - 1);
  team.settle();
  const OracleMap expected =
      fuse({other, epochs[kStarts - 2], epochs[kStarts - 1]}, config.diffusion, 0.1, kTeamClasses);
  const OracleVoxels found = voxels_of(global.map());
  REQUIRE(found.size() == expected.voxels.size());
  for (const auto& [voxel, counts] : expected.voxels) {
    for (std::size_t l = 0; l < counts.size(); ++l)
      REQUIRE(found.at(voxel)[l] == Approx(counts[l]).epsilon(1e-4).margin(1e-4));
  }
  // And the newest alone, once it is the floor.
  global.remove_before(3, kStarts);
  team.settle();
  Team alone(config);
  alone.publish(other, 1);
  alone.publish(epochs.back(), 1);
  alone.settle();
  CHECK(team.digest() == alone.digest());
  CHECK(taken(global) == taken(alone.global()));
}

}  // namespace
}  // namespace tessera::oracle
