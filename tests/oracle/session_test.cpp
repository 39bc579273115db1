// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps of earlier days in the global map, against the rule by brute force: each counts once, by its
// weight, and all together no more than a quarter of the cap.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

constexpr std::uint32_t kFirst = MapSession::kFirst;

void check_all_same(const OracleVoxels& found, const OracleVoxels& expected) {
  for (const auto& [voxel, counts] : expected) {
    const auto at = found.find(voxel);
    double total = 0.0;
    for (const double count : counts) total += count;
    CAPTURE(voxel[0], voxel[1], voxel[2], total);
    if (total == 0.0) continue;  // all of it were passes that the cap of sessions leaves nothing of
    REQUIRE(at != found.end());
    for (std::size_t l = 0; l < counts.size(); ++l) {
      CAPTURE(l, counts[l], at->second[l]);
      REQUIRE(std::fabs(at->second[l] - counts[l]) <= 2e-5 * total + 1e-6);
    }
  }
  for (const auto& item : found) REQUIRE(expected.count(item.first) == 1);
}

/// Robots with maps of today and sessions of four names, some of which several robots have, in
/// several epochs, with other contents, weights and frames, and beyond any cap.
std::vector<OracleContribution> team_with_sessions(Random& random) {
  std::vector<OracleContribution> team;
  const auto add = [&](const ContributionId& id, const MapSession& session) {
    OracleContribution one;
    one.id = id;
    one.session = session;
    one.voxels = random_voxels(random, 200, {-3, 2, 1});
    for (auto& [voxel, counts] : one.voxels) {
      const int kind = random.below(12);
      if (kind == 0) counts[static_cast<std::size_t>(1 + random.below(6))] = 786432.0;
      if (kind == 1) counts[0] = 224.0;
    }
    if (random.below(3) != 0) one.T_global_local = random_transform(random, 20.0, 0.3);
    team.push_back(std::move(one));
  };
  for (const ContributionId id :
       std::vector<ContributionId>{{3, 1, 0}, {3, 2, 0}, {4, 1, 0}, {4, 1, 1}, {9, 5, 0}})
    add(id, {});
  for (const ContributionId id : std::vector<ContributionId>{{3, 1, kFirst},
                                                             {3, 2, kFirst},
                                                             {3, 2, kFirst + 1},
                                                             {4, 1, kFirst},
                                                             {4, 1, kFirst + 1},
                                                             {5, 1, kFirst + 9},
                                                             {9, 4, kFirst},
                                                             {9, 5, kFirst},
                                                             {9, 5, kFirst + 1}}) {
    const int weight = random.below(4);
    add(id, {.digest = 70U + static_cast<std::uint64_t>(random.below(4)),
             .date_s = random.below(1000),
             .weight = static_cast<std::uint16_t>(weight == 0 ? 1 + random.below(32768)
                                                              : weight * 16384 - 16384)});
  }
  return team;
}

TEST_CASE("fusion: sessions count once, by their weight, and together under a quarter of the cap") {
  Random random(announce_seed(2105));
  const auto mode =
      GENERATE(DiffusionMode::kNone, DiffusionMode::kPaper, DiffusionMode::kContractive);
  const float omega = GENERATE(1.0F, 2.0F);
  const bool whole_map = GENERATE(false, true);
  const float cap = GENERATE(8.0F, 24.0F);  // of three robots no more passes than a byte holds
  GlobalMapConfig config = team_config();
  config.max_evidence = cap;
  config.diffusion.mode = mode;
  config.diffusion.iterations = 2;
  config.diffusion.omega = omega;
  config.diffusion.whole_map = whole_map;
  if (mode == DiffusionMode::kPaper) config.map.prior = 0.0;
  std::vector<OracleContribution> team = team_with_sessions(random);
  const OracleMap expected = fuse(team, config.diffusion, 0.1, kTeamClasses,
                                  {.max_evidence = static_cast<double>(cap), .free_weight = 0.5});
  Team fused(config);
  // In whatever order.
  for (std::size_t i = team.size(); i > 1; --i)
    std::swap(team[i - 1], team[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  for (const OracleContribution& contribution : team) fused.publish(contribution, 1);
  fused.settle();
  check_all_same(voxels_of(fused.global().map()), expected.voxels);
  CHECK(fused.global().report().nodes == expected.nodes.size());
  CHECK(expected.nodes.size() > 100);
}

}  // namespace
}  // namespace tessera::oracle
