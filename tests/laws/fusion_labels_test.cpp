// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Diffusion changes the label of a voxel only where two thirds of the evidence around disagree, and
// two fifths of it agree on another one.
#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>

#include "support/random.hpp"
#include "support/team.hpp"

namespace tessera {
namespace {

using oracle::OracleCounts;
using oracle::OracleVoxels;
using oracle::Random;
using oracle::Team;
using oracle::Voxel;

constexpr std::size_t kClasses = oracle::kTeamClasses;

std::size_t label_of(const OracleCounts& counts) {
  const auto first = counts.begin() + 1;
  return static_cast<std::size_t>(std::max_element(first, first + kClasses) - counts.begin());
}

OracleCounts only(std::size_t label, double evidence) {
  OracleCounts counts(kClasses + 2);
  counts[label] = evidence;
  return counts;
}

/// The map of two robots that have the same voxels.
OracleVoxels fused(const OracleVoxels& voxels, DiffusionMode mode) {
  GlobalMapConfig config = oracle::team_config(TuplePolicy::kDense);
  config.diffusion = {.mode = mode};
  Team team(config);
  for (std::uint32_t robot = 0; robot < 2; ++robot)
    team.publish({.id = {robot, 0, 0}, .voxels = voxels}, 1);
  team.settle();
  return oracle::voxels_of(team.global().map());
}

TEST_CASE("fusion: a voxel has another label than its own evidence only by two thirds around it") {
  Random random(oracle::announce_seed(90));
  const int classes = GENERATE(2, 3, 5);
  // As good as all evidence of all classes is the same: levels that rounding alone sets apart.
  const bool alike = GENERATE(false, true);
  CAPTURE(classes, alike);
  OracleVoxels voxels;
  for (std::int64_t x = 0; x < 14; ++x) {
    for (std::int64_t y = 0; y < 14; ++y) {
      for (std::int64_t z = 0; z < 3; ++z) {
        if (random.below(5) == 0) continue;
        // Halves of one class each, with noise.
        const int side = x < 7 ? 0 : 1;
        const int drawn = random.below(3) == 0 ? random.below(classes) : side;
        OracleCounts& counts = voxels[Voxel{x, y, z}] =
            only(static_cast<std::size_t>(1 + drawn), 0.25 * (1 + random.below(alike ? 2 : 40)));
        if (!alike) continue;
        for (int l = 0; l < classes; ++l) counts[static_cast<std::size_t>(1 + l)] += 7.0;
      }
    }
  }
  const OracleVoxels summed = fused(voxels, DiffusionMode::kNone);
  const OracleVoxels diffused = fused(voxels, DiffusionMode::kContractive);
  int changed = 0;
  int kept = 0;
  for (const auto& [voxel, counts] : summed) {
    const std::size_t own = label_of(counts);
    double all = 0.0;
    OracleCounts around(kClasses + 2);
    for (const auto& [other, there] : summed) {
      std::int64_t squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t d = voxel[axis] - other[axis];
        squared += d * d;
      }
      if (squared >= 25) continue;  // nearer than 2.5 D, with D of 2 voxels
      const double sum = std::accumulate(there.begin() + 1, there.begin() + 1 + kClasses, 0.0);
      const double part = std::min(1.0, 2.0 / sum);
      for (std::size_t l = 1; l <= kClasses; ++l) around[l] += part * there[l];
      all += part * sum;
    }
    // In double precision: what float sums may decide otherwise is left open.
    const double slack = 1e-5 * all;
    const bool is_outvoted = 3.0 * around[own] <= all + slack;
    const auto may_follow = [&](std::size_t label) {
      return label != own && 5.0 * around[label] >= 2.0 * all - slack;
    };
    bool may_change = false;
    for (std::size_t l = 1; l <= kClasses; ++l) may_change = may_change || may_follow(l);
    may_change = may_change && is_outvoted;
    const std::size_t found = label_of(diffused.at(voxel));
    CAPTURE(voxel[0], voxel[1], voxel[2], own, found, around[own], around[found], all);
    REQUIRE((found == own || (is_outvoted && may_follow(found))));
    changed += found != own ? 1 : 0;
    kept += !may_change ? 1 : 0;
    // What is kept has as much evidence as before.
    const auto evidence = [](const OracleCounts& c) {
      return std::accumulate(c.begin(), c.end(), 0.0);
    };
    REQUIRE(evidence(diffused.at(voxel)) == Approx(evidence(counts)).epsilon(1e-5));
  }
  CHECK(changed + kept > 100);
  if (!alike) CHECK(changed > 10);
  if (!alike) CHECK(kept > 100);
}

TEST_CASE("fusion: a small thing beside a large one stays, and a single wrong voxel does not") {
  // A post of 2 x 2 voxels in a floor, and a wrong voxel in the middle of a floor.
  OracleVoxels voxels;
  for (std::int64_t x = 0; x < 32; ++x)
    for (std::int64_t y = 0; y < 16; ++y) voxels[Voxel{x, y, 0}] = only(1, 4.0);
  for (std::int64_t z = 0; z < 12; ++z)
    for (const std::int64_t x : {7, 8})
      for (const std::int64_t y : {7, 8}) voxels[Voxel{x, y, z}] = only(2, 4.0);
  voxels[Voxel{24, 8, 0}] = only(3, 4.0);
  const OracleVoxels diffused = fused(voxels, DiffusionMode::kContractive);
  for (std::int64_t z = 2; z < 12; ++z) CHECK(label_of(diffused.at(Voxel{7, 8, z})) == 2);
  CHECK(label_of(diffused.at(Voxel{24, 8, 0})) == 1);
  for (std::int64_t x = 0; x < 32; ++x) {
    if (x < 6 || x > 9) CHECK(label_of(diffused.at(Voxel{x, 3, 0})) == 1);
  }
}

TEST_CASE("fusion: what stands thin before many classes stays, before one it does not") {
  // A wrong voxel, or a sign, in a wall of four classes in turn, or of one.
  for (const bool is_mixed : {true, false}) {
    OracleVoxels voxels;
    for (std::int64_t x = 0; x < 16; ++x) {
      for (std::int64_t z = 0; z < 16; ++z)
        voxels[Voxel{x, 0, z}] =
            only(is_mixed ? static_cast<std::size_t>(1 + (x + 2 * z) % 4) : 1, 4.0);
    }
    const std::size_t sign = 5;
    voxels[Voxel{8, 0, 8}] = only(sign, 4.0);
    CAPTURE(is_mixed);
    CHECK((label_of(fused(voxels, DiffusionMode::kContractive).at(Voxel{8, 0, 8})) == sign) ==
          is_mixed);
  }
}

TEST_CASE("fusion: one neighbour that was seen often does not decide a label alone") {
  // All around say 1, a little; one was seen a hundred times and says 2, as does the voxel itself.
  OracleVoxels voxels;
  for (std::int64_t x = 0; x < 16; ++x)
    for (std::int64_t y = 0; y < 16; ++y) voxels[Voxel{x, y, 0}] = only(1, 2.0);
  voxels[Voxel{8, 8, 0}] = only(2, 0.5);
  voxels[Voxel{8, 9, 0}] = only(2, 100.0);
  CHECK(label_of(fused(voxels, DiffusionMode::kContractive).at(Voxel{8, 8, 0})) == 1);
}

}  // namespace
}  // namespace tessera
