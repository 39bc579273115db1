// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps of earlier days in the global map: who has loaded one is no matter, nor in what order they
// come, move and go; what they count is bounded to the bit; and who lies gains nothing.
#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

constexpr std::uint32_t kFirst = MapSession::kFirst;
constexpr std::uint16_t kHalf = MapSession::kFullWeight / 2;

OracleContribution session_of(std::uint32_t robot, const OracleVoxels& voxels,
                              std::uint64_t digest = 7, std::uint16_t weight = kHalf) {
  OracleContribution one;
  one.id = {robot, 1, kFirst};
  one.voxels = voxels;
  one.session = {.digest = digest, .date_s = 0, .weight = weight};
  return one;
}

OracleContribution today_of(std::uint32_t robot, const OracleVoxels& voxels) {
  OracleContribution one;
  one.id = {robot, 1, 0};
  one.voxels = voxels;
  return one;
}

std::uint64_t digest_of(const GlobalMapConfig& config,
                        const std::vector<OracleContribution>& contributions) {
  Team team(config);
  for (const OracleContribution& one : contributions) team.publish(one, 1);
  team.settle();
  return team.digest();
}

GlobalMapConfig config_of(float max_evidence) {
  GlobalMapConfig config = team_config();
  config.max_evidence = max_evidence;
  return config;
}

/// One voxel.
OracleVoxels one_voxel(int component, double count, double passes = 0.0) {
  OracleCounts counts(kTeamClasses + 2);
  counts[0] = passes;
  if (component != 0) counts[static_cast<std::size_t>(component)] = count;
  return {{{1, 2, 3}, counts}};
}

OracleCounts sums_of(const GlobalMapConfig& config,
                     const std::vector<OracleContribution>& contributions) {
  Team team(config);
  for (const OracleContribution& one : contributions) team.publish(one, 1);
  team.settle();
  const OracleVoxels voxels = voxels_of(team.global().map());
  return voxels.empty() ? OracleCounts(kTeamClasses + 2) : voxels.begin()->second;
}

TEST_CASE("fusion: three robots that load one file give the map of one that does, whoever it is") {
  Random random(announce_seed(2106));
  GlobalMapConfig config = config_of(100.0F);
  config.diffusion.edge = EdgeTerm::kConfidence;
  config.diffusion.whole_map = GENERATE(false, true);
  const OracleVoxels map = random_voxels(random, 600, {0, 0, 0});
  std::vector<OracleContribution> today;
  for (const std::uint32_t robot : {1U, 2U, 3U})
    today.push_back(today_of(robot, random_voxels(random, 200, {0, 0, 0})));
  std::vector<std::uint64_t> digests;
  for (const std::vector<std::uint32_t>& loaders :
       std::vector<std::vector<std::uint32_t>>{{1}, {2}, {3}, {8}, {3, 1, 2}, {2, 3}}) {
    std::vector<OracleContribution> all = today;
    for (const std::uint32_t robot : loaders) all.push_back(session_of(robot, map));
    digests.push_back(digest_of(config, all));
  }
  for (const std::uint64_t digest : digests) CHECK(digest == digests.front());
  CHECK(digests.front() != digest_of(config, today));
}

TEST_CASE("fusion: where the robot with the lowest number has removed a session, the next counts") {
  Random random(announce_seed(2107));
  const GlobalMapConfig config = config_of(100.0F);
  const OracleVoxels map = random_voxels(random, 300, {0, 0, 0});
  const OracleVoxels today = random_voxels(random, 300, {0, 0, 0});
  const OracleContribution low = session_of(1, map, 7, kHalf);
  const OracleContribution high = session_of(2, map, 7, kHalf / 4);
  const std::uint64_t with_low = digest_of(config, {today_of(1, today), low});
  const std::uint64_t with_high = digest_of(config, {today_of(1, today), high});
  const std::uint64_t with_none = digest_of(config, {today_of(1, today)});
  REQUIRE(with_low != with_high);
  REQUIRE(with_high != with_none);
  const bool by_weight = GENERATE(false, true);
  Team team(config);
  for (const OracleContribution& one : {today_of(1, today), high, low}) team.publish(one, 1);
  team.settle();
  CHECK(team.digest() == with_low);
  const auto remove = [&](const OracleContribution& one) {
    const GlobalMap::Slot slot = *team.global().replicas().find(one.id);
    MapSession ended = one.session;
    ended.weight = 0;
    if (by_weight) {
      REQUIRE(team.global().set_frame(slot, GridTransform(), 2, ended) == Replicas::Change::kTaken);
    } else {
      team.global().remove(slot);
    }
    // Before or after as a whole: readers see no half of it.
    while (team.global().busy()) team.global().step(200);
  };
  remove(low);
  CHECK(team.digest() == with_high);
  remove(high);
  CHECK(team.digest() == with_none);
}

TEST_CASE("fusion: the weight and the cap of sessions, to the bit") {
  GlobalMapConfig config = config_of(100.0F);
  config.diffusion.mode = DiffusionMode::kNone;
  const auto sums = [&](const std::vector<OracleContribution>& all) {
    return sums_of(config, all);
  };
  const auto labels = [&](const std::vector<OracleContribution>& all) { return sums(all)[2]; };
  const auto passes = [&](const std::vector<OracleContribution>& all) { return sums(all)[0]; };
  // Half of it, and a weight that is no power of two: a product of floats.
  CHECK(labels({session_of(1, one_voxel(2, 12.0))}) == 6.0);
  CHECK(labels({session_of(1, one_voxel(2, 3.0), 7, 10923)}) ==
        static_cast<double>(3.0F * (10923.0F / 32768.0F)));
  // A quarter of the cap, in all of its classes, of its name and of all names.
  CHECK(labels({session_of(1, one_voxel(2, 50.0))}) == 25.0);
  CHECK(labels({session_of(1, one_voxel(2, 50.25))}) == 25.0);
  CHECK(labels({session_of(1, one_voxel(2, 1000.0), 7, MapSession::kFullWeight)}) == 25.0);
  OracleContribution other = session_of(1, one_voxel(4, 786432.0), 8, MapSession::kFullWeight);
  other.id.submap = kFirst + 1;
  const OracleCounts both = sums({session_of(1, one_voxel(2, 786432.0), 7), other});
  CHECK(both[2] + both[4] == Approx(25.0));
  CHECK(both[4] == Approx(2.0 * both[2]));
  // Beside what a robot says today, which keeps its own cap.
  CHECK(labels({session_of(1, one_voxel(2, 50.0)), today_of(1, one_voxel(2, 100.0))}) == 125.0);
  // Passes are rounded down, but a voxel that was seen free stays so.
  CHECK(passes({session_of(1, one_voxel(0, 0.0, 7.0))}) == 3.0);
  CHECK(passes({session_of(1, one_voxel(0, 0.0, 1.0), 7, 1)}) == 1.0);
  CHECK(passes({session_of(1, one_voxel(0, 0.0, 200.0), 7, MapSession::kFullWeight)}) == 50.0);
  // Labels and passes share the quarter: 40 and 80 * 0.5 are scaled by 25 / 80.
  const OracleCounts shared =
      sums({session_of(1, one_voxel(2, 40.0, 80.0), 7, MapSession::kFullWeight)});
  CHECK(shared[2] == 12.5);
  CHECK(shared[0] == 25.0);
  // Without a cap of the robots' maps it is a quarter of 250.
  config.max_evidence = 0.0F;
  CHECK(labels({session_of(1, one_voxel(2, 786432.0))}) == 62.5);
}

TEST_CASE("fusion: what one robot sees today overrules all sessions of all robots") {
  GlobalMapConfig config = config_of(100.0F);
  config.diffusion.mode = DiffusionMode::kNone;
  Team team(config);
  for (std::uint32_t robot = 1; robot <= 8; ++robot) {
    OracleContribution session =
        session_of(robot, one_voxel(2, 786432.0, 224.0), robot, MapSession::kFullWeight);
    team.publish(session, 1);
  }
  team.publish(today_of(9, one_voxel(4, 26.0)), 1);
  team.settle();
  CHECK(team.global().query({1, 2, 3}).label == 4);
}

TEST_CASE(
    "fusion: a robot that names a session which it does not have hides nothing but what it says") {
  Random random(announce_seed(2108));
  const GlobalMapConfig config = config_of(100.0F);
  const OracleVoxels map = random_voxels(random, 400, {0, 0, 0});
  const OracleVoxels today = random_voxels(random, 100, {0, 0, 0});
  const std::vector<OracleContribution> honest = {today_of(3, today), session_of(3, map)};
  const std::uint64_t expected = digest_of(config, honest);
  // Nothing, or something elsewhere; with the lowest number and the same name.
  std::vector<OracleContribution> with_empty = honest;
  with_empty.push_back(session_of(1, {}));
  CHECK(digest_of(config, with_empty) == expected);
  // In a voxel of it, no more than a session may count there.
  OracleVoxels lies;
  for (const auto& item : map) {
    lies[item.first] = OracleCounts(kTeamClasses + 2);
    lies[item.first][5] = 786432.0;
  }
  std::vector<OracleContribution> with_lies = honest;
  with_lies.push_back(session_of(1, lies, 7, MapSession::kFullWeight));
  Team team(config);
  for (const OracleContribution& one : with_lies) team.publish(one, 1);
  team.settle();
  GlobalMapConfig undiffused = config;
  undiffused.diffusion.mode = DiffusionMode::kNone;
  Team sums(undiffused);
  for (const OracleContribution& one : with_lies) sums.publish(one, 1);
  sums.settle();
  const OracleVoxels found = voxels_of(sums.global().map());
  for (const auto& item : map) {
    const auto seen = today.find(item.first);
    const double honest_evidence = seen == today.end() ? 0.0 : seen->second[5];
    CHECK(found.at(item.first)[5] <= honest_evidence + 25.0 + 1e-3);
  }
  // Once it is excluded all is as before.
  team.global().remove(*team.global().replicas().find({1, 1, kFirst}));
  team.settle();
  CHECK(team.digest() == expected);
}

TEST_CASE("fusion: sessions in any order, repetition, move, weight and end are as fusing anew") {
  Random random(announce_seed(2109));
  GlobalMapConfig config = config_of(GENERATE(4.0F, 100.0F));
  config.diffusion.edge = EdgeTerm::kConfidence;
  config.diffusion.length_m = 0.2F;
  Team team(config);
  std::vector<OracleContribution> all;
  for (std::uint32_t i = 0; i < 9; ++i) {
    OracleContribution one =
        i < 3 ? today_of(i, random_voxels(random, 150, {0, 0, 0}))
              : session_of(i % 4, random_voxels(random, 150, {0, 0, 0}), i % 3, kHalf);
    if (i >= 3) one.id = {i % 4, 1 + i % 2, kFirst + i};
    if (i % 2 != 0) one.T_global_local = random_transform(random, 20.0, 0.3);
    all.push_back(one);
  }
  std::vector<std::size_t> order(all.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  for (const std::size_t i : order) {
    team.publish(all[i], 1);
    team.global().step(static_cast<std::uint64_t>(random.below(20000)));
  }
  std::vector<bool> removed(all.size());
  for (std::uint32_t revision = 2; revision < 40; ++revision) {
    const auto i = static_cast<std::size_t>(random.below(static_cast<int>(all.size())));
    if (removed[i]) continue;
    OracleContribution& one = all[i];
    const GlobalMap::Slot slot = *team.global().replicas().find(one.id);
    if (random.below(8) == 0) {
      team.global().remove(slot);
      removed[i] = true;
    } else {
      if (random.below(2) == 0) one.T_global_local = random_transform(random, 20.0, 0.3);
      if (MapSession::is(one.id.submap)) {
        one.session.digest = static_cast<std::uint64_t>(random.below(3));
        one.session.weight = static_cast<std::uint16_t>(random.below(3) * 16384);
      }
      REQUIRE(team.global().set_frame(slot, *GridTransform::make(one.T_global_local, 0.1), revision,
                                      one.session) == Replicas::Change::kTaken);
    }
    team.global().step(static_cast<std::uint64_t>(random.below(60000)));
  }
  team.settle();
  std::vector<OracleContribution> left;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!removed[i]) left.push_back(all[i]);
  }
  REQUIRE(left.size() >= 3);
  CHECK(team.digest() == digest_of(config, left));
  std::reverse(left.begin(), left.end());
  CHECK(team.digest() == digest_of(config, left));
}

}  // namespace
}  // namespace tessera::oracle
