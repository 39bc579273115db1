// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The global map against the specification's formulas as dense matrices in double precision.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "support/cloud.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

std::vector<OracleContribution> random_team(Random& random, int robots, double degrees) {
  std::vector<OracleContribution> team;
  for (int i = 0; i < robots; ++i) {
    OracleContribution contribution;
    contribution.id = {static_cast<std::uint32_t>(10 + i), 0, 0};
    contribution.voxels = random_voxels(random, 400, {-3, 2, 1});
    contribution.centroids = random_centroids(random, contribution.voxels);
    if (degrees > 0.0) contribution.T_global_local = random_transform(random, degrees, 0.6);
    team.push_back(std::move(contribution));
  }
  return team;
}

/// Relative to a voxel's evidence: what float sums can do.
void check_same(const OracleVoxels& found, const OracleMap& map) {
  REQUIRE(found.size() == map.voxels.size());
  REQUIRE(50 * map.undecided.size() <= map.nodes.size());
  for (const auto& [voxel, counts] : map.voxels) {
    if (std::find(map.undecided.begin(), map.undecided.end(), voxel) != map.undecided.end())
      continue;
    const auto at = found.find(voxel);
    REQUIRE(at != found.end());
    double total = 0.0;
    for (const double count : counts) total += count;
    for (std::size_t l = 0; l < counts.size(); ++l) {
      CAPTURE(voxel[0], voxel[1], voxel[2], l, counts[l], at->second[l]);
      REQUIRE(std::fabs(at->second[l] - counts[l]) <= 2e-5 * total + 1e-6);
    }
  }
}

TEST_CASE("fusion: the global map is that of the formulas, in every mode and frame") {
  const std::uint64_t seed = announce_seed(41);
  Random random(seed);
  const double degrees = GENERATE(0.0, 3.0, 17.0, 45.0);
  const auto mode =
      GENERATE(DiffusionMode::kNone, DiffusionMode::kPaper, DiffusionMode::kContractive);
  const int iterations = GENERATE(1, 2, 3);
  const bool whole_map = GENERATE(false, true);
  GlobalMapConfig config = team_config();
  config.diffusion.mode = mode;
  config.diffusion.iterations = iterations;
  config.diffusion.length_m = 0.27F;
  config.diffusion.alpha = 0.7F;
  config.diffusion.omega = 1.0F;
  config.diffusion.whole_map = whole_map;
  if (mode == DiffusionMode::kPaper) config.map.prior = 0.0;
  CAPTURE(degrees, to_string(mode), iterations, whole_map);
  const std::vector<OracleContribution> team = random_team(random, 3, degrees);
  Team fused(config);
  for (const OracleContribution& contribution : team) fused.publish(contribution, 1);
  fused.settle();
  const OracleMap expected = fuse(team, config.diffusion, 0.1, kTeamClasses);
  check_same(voxels_of(fused.global().map()), expected);
  const GlobalMapReport report = fused.global().report();
  CHECK(report.nodes == expected.nodes.size());
  CHECK(report.nodes > 100);
  if (mode == DiffusionMode::kContractive) {
    CHECK(expected.kept_labels > 0);
    CHECK(report.residual == Approx(expected.residual).epsilon(1e-4));
    CHECK(report.residual <= std::pow(0.7, iterations) * (1.0 + 1e-5));
  }
  CHECK(report.refused_blocks + report.refused_sums + report.refused_outputs == 0);
}

/// Contributions that lie on each other; some counts are beyond any cap.
std::vector<OracleContribution> restarted_team(Random& random) {
  std::vector<OracleContribution> team;
  for (const ContributionId id : std::vector<ContributionId>{{3, 1, 0},
                                                             {3, 2, 0},
                                                             {3, 2, 1},
                                                             {3, 9, 0},
                                                             {4, 0, 0},
                                                             {4, 0, 1},
                                                             {5, 7, 0},
                                                             {5, 7, 1},
                                                             {5, 7, 2},
                                                             {5, 8, 2},
                                                             {5, 8, 3},
                                                             {5, 9, 3}}) {
    OracleContribution contribution;
    contribution.id = id;
    contribution.voxels = random_voxels(random, 250, {-3, 2, 1});
    for (auto& [voxel, counts] : contribution.voxels) {
      const int kind = random.below(8);
      if (kind == 0) counts[static_cast<std::size_t>(1 + random.below(6))] = 786432.0;
      if (kind == 1) counts[0] = 224.0;
    }
    contribution.centroids = random_centroids(random, contribution.voxels);
    if (random.below(4) != 0) contribution.T_global_local = random_transform(random, 20.0, 0.3);
    team.push_back(std::move(contribution));
  }
  return team;
}

TEST_CASE("fusion: in each voxel submaps of newer epochs replace older ones, held under the cap") {
  Random random(announce_seed(44));
  const auto mode =
      GENERATE(DiffusionMode::kNone, DiffusionMode::kPaper, DiffusionMode::kContractive);
  const float omega = GENERATE(1.0F, 2.0F);
  GlobalMapConfig config = team_config();
  config.max_evidence = 8.0F;  // 16 passes
  config.diffusion.mode = mode;
  config.diffusion.iterations = 2;
  config.diffusion.omega = omega;
  if (mode == DiffusionMode::kPaper) config.map.prior = 0.0;
  std::vector<OracleContribution> team = restarted_team(random);
  const OracleMap expected =
      fuse(team, config.diffusion, 0.1, kTeamClasses, {.max_evidence = 8.0, .free_weight = 0.5});
  Team fused(config);
  // In whatever order.
  for (std::size_t i = team.size(); i > 1; --i)
    std::swap(team[i - 1], team[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  for (const OracleContribution& contribution : team) fused.publish(contribution, 1);
  fused.settle();
  check_same(voxels_of(fused.global().map()), expected);
  CHECK(fused.global().report().nodes == expected.nodes.size());
  CHECK(expected.nodes.size() > 100);
}

TEST_CASE("fusion: omega weighs all evidence") {
  Random random(announce_seed(42));
  GlobalMapConfig config = team_config();
  config.diffusion.mode = DiffusionMode::kContractive;
  config.diffusion.omega = 2.0F;
  const std::vector<OracleContribution> team = random_team(random, 2, 0.0);
  Team fused(config);
  for (const OracleContribution& contribution : team) fused.publish(contribution, 1);
  fused.settle();
  check_same(voxels_of(fused.global().map()), fuse(team, config.diffusion, 0.1, kTeamClasses));
}

TEST_CASE("fusion: no voxel appears that nobody observed, and none is lost") {
  Random random(announce_seed(43));
  const GlobalMapConfig config = team_config();
  const std::vector<OracleContribution> team = random_team(random, 4, 30.0);
  Team fused(config);
  double given = 0.0;
  for (const OracleContribution& contribution : team) {
    fused.publish(contribution, 1);
    double least = 0.0;
    for (const auto& [voxel, counts] : contribution.voxels) {
      const std::size_t targets = phi(contribution.T_global_local, 0.1, voxel).size();
      const bool by_centroid = contribution.centroids.contains(voxel);
      CHECK(targets >= 1);
      double labels = 0.0;
      for (std::size_t l = 1; l < counts.size(); ++l) labels += counts[l];
      least += by_centroid ? labels : labels * static_cast<double>(targets);
    }
    // By a centroid, all of it to where that is, and an eighth to those of the voxels that take it
    // where none of that is.
    double of_one = 0.0;
    for (const auto& [voxel, here] : resampled(contribution, 0.1))
      for (std::size_t l = 1; l < here.counts.size(); ++l) of_one += here.counts[l];
    CHECK(of_one > least * (1.0 - 1e-9));
    given += of_one;
  }
  fused.settle();
  double found = 0.0;
  for (const auto& [voxel, counts] : voxels_of(fused.global().map())) {
    for (std::size_t l = 1; l < counts.size(); ++l) found += counts[l];
  }
  CHECK(found == Approx(given).epsilon(1e-5));
}

}  // namespace
}  // namespace tessera::oracle
