// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots object to in the global map: counted by brute force, whatever came first, until what
// they object to says something else or they are gone.
#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>
#include <set>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

constexpr double kVoxel_m = 0.1;

GlobalMapConfig config_of(DiffusionMode mode) {
  GlobalMapConfig config = team_config();
  config.max_evidence = 1e6F;
  config.diffusion.mode = mode;
  return config;
}

std::vector<Objection> random_objections(Random& random, const OracleContribution& against) {
  std::map<std::uint64_t, Objection> by_block;
  for (const auto& [voxel, counts] : against.voxels) {
    const VoxelCoord at = coord_of(voxel);
    if (random.below(3) != 0) continue;
    const BlockKey key = pack_in_grid(block_of(at));
    Objection& one = by_block[key.bits];
    one.against = against.id;
    one.key = key;
    one.version = 1;
    add_row(one.voxels, row_order(at));
  }
  std::vector<Objection> all;
  for (const auto& [key, one] : by_block) all.push_back(one);
  return all;
}

/// As the exchange hands it over. epoch: of the robot that objects.
Status object(Team& team, std::uint32_t robot, const Objection& one, std::uint32_t version,
              std::uint32_t epoch = 1) {
  std::array<std::byte, Objection::kMostBytes> bytes;
  const std::size_t size = one.write(bytes);
  const GlobalMap::Slot slot =
      *team.global().open({robot, epoch, Objection::kNumber}, GridTransform());
  return team.global()
      .put(slot, Objection::place_of(one.against, one.key), version, std::span(bytes).first(size))
      .status();
}

/// Sums as they should be: each voxel where phi has it, without what as many robots object to as
/// have it occupied.
OracleVoxels sums_of(const std::vector<OracleContribution>& contributions,
                     const std::map<std::uint32_t, std::vector<Objection>>& objections) {
  std::map<Voxel, std::map<std::uint32_t, double>> weights;
  for (const OracleContribution& one : contributions)
    for (const auto& [voxel, counts] : one.voxels)
      for (const Voxel& to : phi(one.T_global_local, kVoxel_m, voxel))
        weights[to][one.id.robot] +=
            std::accumulate(counts.begin() + 1, counts.end(), -0.5 * counts[0]);
  const auto holders = [&](const Voxel& to) {
    return std::count_if(weights[to].begin(), weights[to].end(),
                         [](const auto& of_robot) { return of_robot.second > 0.0; });
  };
  const auto objectors = [&](const ContributionId& id, const Voxel& voxel) {
    const VoxelCoord at = coord_of(voxel);
    std::set<std::uint32_t> robots;
    for (const auto& [robot, all] : objections)
      for (const Objection& one : all)
        if (one.against == id && one.key == pack_in_grid(block_of(at)) &&
            has_row(one.voxels, row_order(at)))
          robots.insert(robot);
    return static_cast<std::ptrdiff_t>(robots.size());
  };
  OracleVoxels sums;
  for (const OracleContribution& one : contributions) {
    for (const auto& [voxel, counts] : one.voxels) {
      const std::ptrdiff_t against = objectors(one.id, voxel);
      for (const Voxel& to : phi(one.T_global_local, kVoxel_m, voxel)) {
        const bool counts_labels = against == 0 || against < holders(to);
        if (!counts_labels && counts[0] == 0.0) continue;
        OracleCounts& sum = sums[to];
        sum.resize(counts.size());
        for (std::size_t c = 0; c < counts.size(); ++c)
          sum[c] += c == 0 || counts_labels ? counts[c] : 0.0;
      }
    }
  }
  return sums;
}

struct Scene {
  explicit Scene(std::uint64_t seed, double degrees) : random(announce_seed(seed)) {
    for (std::uint32_t robot = 0; robot < 3; ++robot) {
      OracleContribution one;
      one.id = {robot, 1, 0};
      one.T_global_local = random_transform(random, degrees, 0.4);
      one.voxels = random_voxels(random, 500, {0, 0, 0});
      contributions.push_back(one);
    }
    for (const std::uint32_t robot : {2U, 7U, 8U})
      for (const OracleContribution& one : contributions)
        for (const Objection& objection : random_objections(random, one))
          objections[robot].push_back(objection);
  }
  void publish(Team& team, std::uint32_t version = 1) const {
    for (const OracleContribution& one : contributions) team.publish(one, version);
  }
  void object_all(Team& team) const {
    std::uint32_t version = 0;
    for (const auto& [robot, all] : objections)
      for (const Objection& one : all) REQUIRE(object(team, robot, one, ++version) == Status::kOk);
  }
  Random random;
  std::vector<OracleContribution> contributions;
  std::map<std::uint32_t, std::vector<Objection>> objections;
};

void check_equal(const OracleVoxels& expected, const OracleVoxels& found) {
  REQUIRE(expected.size() == found.size());
  for (const auto& [voxel, counts] : expected) {
    REQUIRE(found.count(voxel) == 1);
    for (std::size_t c = 0; c < counts.size(); ++c)
      CHECK(found.at(voxel)[c] == Approx(counts[c]).epsilon(1e-5));
  }
}

}  // namespace

TEST_CASE("objections: sums are without what as many robots object to as have it") {
  const Scene scene(3101, GENERATE(0.0, 33.0));
  Team team(config_of(DiffusionMode::kNone));
  scene.publish(team);
  team.settle();
  check_equal(sums_of(scene.contributions, {}), voxels_of(team.global().map()));
  scene.object_all(team);
  team.settle();
  check_equal(sums_of(scene.contributions, scene.objections), voxels_of(team.global().map()));
  const GlobalMapReport report = team.global().report();
  CHECK(report.objected_voxels > 100);
  CHECK(report.disputed_voxels > 10);
}

TEST_CASE("objections: the map is the same whatever came first") {
  const Scene scene(3102, 21.0);
  const DiffusionMode mode = GENERATE(DiffusionMode::kNone, DiffusionMode::kContractive);
  Team after(config_of(mode));
  scene.publish(after);
  after.settle();
  scene.object_all(after);
  after.settle();
  Team before(config_of(mode));
  scene.object_all(before);
  before.settle();
  scene.publish(before);
  before.settle();
  CHECK(before.digest() == after.digest());
  Team beside(config_of(mode));
  scene.publish(beside);
  scene.object_all(beside);
  beside.settle();
  CHECK(beside.digest() == after.digest());
}

TEST_CASE("objections: they end with the version that was heard, and with who made them") {
  const Scene scene(3103, 12.0);
  Team team(config_of(DiffusionMode::kContractive));
  scene.publish(team);
  team.settle();
  const std::uint64_t without = team.digest();
  scene.object_all(team);
  team.settle();
  const std::uint64_t with = team.digest();
  REQUIRE(with != without);
  SECTION("a later version") {
    scene.publish(team, 2);
    team.settle();
    CHECK(team.digest() == without);
    CHECK(team.global().report().objected_voxels == 0);
  }
  SECTION("robots that leave") {
    for (const std::uint32_t robot : {2U, 7U, 8U})
      team.global().remove(*team.global().open({robot, 1, Objection::kNumber}, GridTransform()));
    team.settle();
    CHECK(team.digest() == without);
  }
  SECTION("one in the same place") {
    const Objection& one = scene.objections.at(7).front();
    Objection other = one;
    other.voxels = {};
    add_row(other.voxels, 5);
    std::uint32_t version = 10000;
    for (const std::uint32_t robot : {2U, 7U, 8U}) {
      for (Objection objection : scene.objections.at(robot)) {
        objection.version = 0;  // nothing that was published
        REQUIRE(object(team, robot, objection, ++version) == Status::kOk);
      }
    }
    team.settle();
    CHECK(team.digest() == without);
  }
  SECTION("frames that move take them with them") {
    Team moved(config_of(DiffusionMode::kContractive));
    std::vector<OracleContribution> there = scene.contributions;
    for (OracleContribution& one : there) one.T_global_local(0, 3) += 1.6;
    for (const OracleContribution& one : there) moved.publish(one, 1);
    scene.object_all(moved);
    moved.settle();
    for (const OracleContribution& one : there)
      static_cast<void>(team.global().set_frame(*team.global().open(one.id, GridTransform()),
                                                *GridTransform::make(one.T_global_local, kVoxel_m),
                                                2));
    team.settle();
    CHECK(team.digest() == moved.digest());
  }
}

TEST_CASE("objections: a robot counts once, however often it began anew") {
  Team team(config_of(DiffusionMode::kNone));
  OracleCounts counts(kTeamClasses + 2);
  counts[1] = 3.0;
  for (const std::uint32_t robot : {1U, 2U}) {
    OracleContribution one;
    one.id = {robot, 1, 0};
    one.voxels = {{{1, 2, 3}, counts}};
    team.publish(one, 1);
  }
  for (const std::uint32_t epoch : {1U, 2U, 3U}) {
    for (const std::uint32_t robot : {1U, 2U}) {
      Objection one{.against = {robot, 1, 0}, .key = pack_in_grid({0, 0, 0}), .version = 1};
      add_row(one.voxels, row_order(VoxelCoord{1, 2, 3}));
      REQUIRE(object(team, 9, one, robot, epoch) == Status::kOk);
    }
  }
  team.settle();
  CHECK(team.global().query({1, 2, 3}).state == VoxelState::kOccupied);
  CHECK(team.global().report().disputed_voxels == 1);
  CHECK(team.global().report().objected_voxels == 0);
}

TEST_CASE("objections: what is none, or in a wrong place, is refused") {
  Team team(config_of(DiffusionMode::kNone));
  const GlobalMap::Slot slot = *team.global().open({9, 1, Objection::kNumber}, GridTransform());
  Objection one{.against = {1, 1, 0}, .key = pack_in_grid({0, 0, 0}), .version = 1};
  add_row(one.voxels, 7);
  std::array<std::byte, Objection::kMostBytes> bytes;
  const std::span<const std::byte> good = std::span(bytes).first(one.write(bytes));
  const BlockKey place = Objection::place_of(one.against, one.key);
  const BlockKey elsewhere = pack_in_grid({unpack(place).x ^ 1, unpack(place).y, 0});
  CHECK(team.global().put(slot, elsewhere, 1, good).status() == Status::kCorrupt);
  CHECK(team.global().put(slot, place, 1, good.first(good.size() - 1)).status() ==
        Status::kCorrupt);
  CHECK(team.global().put(slot, place, 1, {}).status() == Status::kCorrupt);
  CHECK(team.global().put(slot, place, 1, good).ok());
}

}  // namespace tessera::oracle
