// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots whose worlds are placed in the team's: the map is that of their contributions at composed
// frames, without those of robots that have no place.
#include <catch2/catch.hpp>

#include "support/cloud.hpp"
#include "support/placed_robots.hpp"

namespace tessera::oracle {
namespace {

constexpr std::array<std::uint32_t, 4> kRobots{0, 3, 70, 4'000'000'000};

/// Robots that say, move, leave and are placed at random.
class Rig {
 public:
  explicit Rig(Random& random) : random_(random), team_(places_config(true)) {}

  void act() {
    const int what = random_.below(20);
    if (what < 7) return put(any_id());
    if (what < 9) return object();
    if (what < 12) return set_frame(any_id());
    if (what < 17) return place(kRobots[at_random(kRobots.size())]);
    if (what == 17) return withdraw(any_id());
    if (what == 18) return remove(any_id());
    global().set_focus(BlockCoord{random_.below(3), random_.below(3), 0});
  }
  void step() {
    static_cast<void>(global().step(static_cast<std::uint64_t>(random_.below(budget_))));
    if (random_.below(8) == 0) budget_ = 1 << (4 + random_.below(14));
  }
  void check() {
    team_.settle();
    Team anew(places_config(false));
    said.fuse(anew);
    REQUIRE(team_.digest() == anew.digest());
    const GlobalMapReport found = global().report();
    const GlobalMapReport expected = anew.global().report();
    REQUIRE(found.blocks == expected.blocks);
    REQUIRE(found.nodes == expected.nodes);
    REQUIRE(found.sum_bytes == expected.sum_bytes);
    REQUIRE(found.objected_voxels == expected.objected_voxels);
    REQUIRE(found.disputed_voxels == expected.disputed_voxels);
    REQUIRE(found.out_of_grid == said.out_of_grid());
    REQUIRE(found.torn_blocks == 0);
    objected += found.objected_voxels;
    out_of_grid += found.out_of_grid;
    nodes += found.nodes;
    for (const std::uint32_t robot : kRobots) {
      const Result<RobotReliability> here = global().reliability(robot);
      const Result<RobotReliability> there = anew.global().reliability(robot);
      REQUIRE(here.ok() == there.ok());
      if (here.ok()) REQUIRE(here->reliability == there->reliability);
      if (here.ok()) REQUIRE(here->shared == there->shared);
    }
  }
  [[nodiscard]] GlobalMap& global() { return team_.global(); }

  Said said;
  std::uint64_t objected = 0;
  std::uint64_t out_of_grid = 0;
  std::uint64_t nodes = 0;

 private:
  std::size_t at_random(std::size_t size) {
    return static_cast<std::size_t>(random_.below(static_cast<int>(size)));
  }
  ContributionId any_id() {
    const auto epoch = static_cast<std::uint32_t>(1 + random_.below(2));
    const auto submap = static_cast<std::uint32_t>(random_.below(2));
    return {kRobots[at_random(kRobots.size())], epoch,
            random_.below(4) == 0 ? MapSession::kFirst + submap : submap};
  }
  /// Nothing: one of that name is leaving.
  std::optional<GlobalMap::Slot> open(const ContributionId& id) {
    const Result<GlobalMap::Slot> known = global().replicas().find(id);
    if (known.ok())
      return global().leaving(*known) ? std::nullopt : std::optional<GlobalMap::Slot>(*known);
    Said::One& one = said.contributions[id];
    one = {};
    if (!Objection::is(id.submap)) one.T_world_local = any_frame();
    return *global().open(id, grid_of(one.T_world_local));
  }
  Matrix34d any_frame() {
    if (random_.below(3) == 0) return shift_of(0.1 * (random_.below(9) - 4));
    return random_transform(random_, 25.0, 0.4);
  }
  void put_block(GlobalMap::Slot slot, const ContributionId& id, std::uint64_t key,
                 const std::vector<std::byte>& bytes) {
    const std::uint32_t version = ++version_;
    REQUIRE(global().put(slot, BlockKey{key}, version, bytes).ok());
    said.contributions.at(id).blocks[key] = {version, bytes};
  }
  void put(const ContributionId& id) {
    const std::optional<GlobalMap::Slot> slot = open(id);
    if (!slot) return;
    for (const auto& [key, bytes] : pack_voxels(random_voxels(random_, 25, {0, 0, 0})))
      put_block(*slot, id, key, bytes);
  }
  void withdraw(const ContributionId& id) {
    const std::optional<GlobalMap::Slot> slot = open(id);
    if (!slot) return;
    for (auto& [key, block] : said.contributions.at(id).blocks)
      if (random_.below(2) == 0) put_block(*slot, id, key, {});
  }
  void set_frame(const ContributionId& id) {
    const std::optional<GlobalMap::Slot> slot = open(id);
    if (!slot) return;
    Said::One& one = said.contributions.at(id);
    if (random_.below(4) != 0) one.T_world_local = any_frame();
    one.revision += 2;
    one.session = {};
    if (MapSession::is(id.submap)) {
      one.session.digest = static_cast<std::uint64_t>(random_.below(2));
      one.session.weight = static_cast<std::uint16_t>(random_.below(3) * 16384);
    }
    REQUIRE(global().set_frame(*slot, grid_of(one.T_world_local), one.revision, one.session) ==
            Replicas::Change::kTaken);
    // A late one moves nothing.
    REQUIRE(global().set_frame(*slot, grid_of(shift_of(3.0)), one.revision - 1) ==
            Replicas::Change::kStale);
  }
  void place(std::uint32_t robot) {
    const int what = random_.below(8);
    const auto before = said.places.find(robot);
    std::optional<Matrix34d> T;
    if (what == 7 && before != said.places.end()) T = before->second;
    if (what == 6) T = shift_of(kEdgeOfGrid_m);
    if (what == 5) T = Matrix34d::Identity();
    if (what == 4) T = shift_of(0.1 * random_.below(4));
    if (what < 4 && what > 0) T = random_transform(random_, 15.0, 0.4);
    const bool stale =
        T ? before != said.places.end() && before->second == *T : before == said.places.end();
    REQUIRE(*global().place(robot, T) ==
            (stale ? Replicas::Change::kStale : Replicas::Change::kTaken));
    said.places.erase(robot);
    if (T) said.places[robot] = *T;
  }
  void remove(const ContributionId& id) {
    const Result<GlobalMap::Slot> slot = global().replicas().find(id);
    if (!slot.ok()) return;
    global().remove(*slot);
    said.contributions.erase(id);
  }
  void object() {
    const ContributionId id{kRobots[at_random(kRobots.size())], 1, Objection::kNumber};
    const auto against = said.contributions.find(any_id());
    if (against == said.contributions.end() || against->second.blocks.empty()) return;
    const std::optional<GlobalMap::Slot> slot = open(id);
    if (!slot) return;
    for (const auto& [key, block] : against->second.blocks) {
      Objection one{.against = against->first, .key = BlockKey{key}, .version = block.first};
      if (random_.below(6) == 0) one.version = 0;  // withdrawn
      for (std::uint64_t& slice : one.voxels) slice = random_.below(2) == 0 ? ~0ULL : 0x0fULL;
      std::vector<std::byte> bytes(Objection::kMostBytes);
      bytes.resize(one.write(bytes));
      put_block(*slot, id, Objection::place_of(one.against, one.key).bits, bytes);
    }
  }

  Random& random_;
  Team team_;
  std::uint32_t version_ = 0;
  int budget_ = 1 << 12;
};

}  // namespace

TEST_CASE("places: whatever robots say and wherever they are placed, it is as fusing that anew") {
  const std::uint64_t seed = announce_seed(8101);
  std::uint64_t objected = 0;
  std::uint64_t out_of_grid = 0;
  std::uint64_t nodes = 0;
  for (std::uint64_t sequence = 0; sequence < 300; ++sequence) {
    CAPTURE(sequence);
    Random random(seed + sequence);
    Rig rig(random);
    for (int i = 0; i < 36; ++i) {
      rig.act();
      if (random.below(3) != 0) rig.step();
    }
    rig.check();
    for (const std::uint32_t robot : kRobots) {
      REQUIRE(rig.global().place(robot, std::nullopt).ok());
      rig.said.places.erase(robot);
    }
    rig.check();
    REQUIRE(rig.global().map().block_count() == 0);
    REQUIRE(rig.global().report().blocks == 0);
    objected += rig.objected;
    out_of_grid += rig.out_of_grid;
    nodes += rig.nodes;
  }
  // The sequences reach what they are for.
  CHECK(objected > 1000);
  CHECK(out_of_grid > 50);
  CHECK(nodes > 1000);
}

}  // namespace tessera::oracle
