// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The same contributions give the same global map, to the bit, whatever the compiler, its
// optimisation and the architecture. A digest here changes only if fusion does.
#include <catch2/catch.hpp>

#include "support/digest_by_rows.hpp"
#include "support/team.hpp"

namespace tessera::oracle {
namespace {

/// The turn of a quaternion of whole numbers: no function of libm, so the same everywhere.
Matrix34d turned(double a, double b, double c, double d) {
  const double n = a * a + b * b + c * c + d * d;
  Matrix34d T;
  T << (a * a + b * b - c * c - d * d) / n, 2 * (b * c - a * d) / n, 2 * (b * d + a * c) / n, 0.35,
      2 * (b * c + a * d) / n, (a * a - b * b + c * c - d * d) / n, 2 * (c * d - a * b) / n, -0.2,
      2 * (b * d - a * c) / n, 2 * (c * d + a * b) / n, (a * a - b * b - c * c + d * d) / n, 0.1;
  return T;
}

TEST_CASE("golden digest: fusing the same contributions gives the same map on every machine") {
  struct Golden {
    DiffusionMode mode;
    EdgeTerm edge;
    TuplePolicy tuple;
    std::uint64_t digest;
    std::uint64_t by_rows;
  };
  const Golden golden =
      GENERATE(Golden{DiffusionMode::kContractive, EdgeTerm::kConfidence, TuplePolicy::kCompact,
                      0x8379a20c7c9f1db5U, 0x36fbeed93f6ceb39U},
               Golden{DiffusionMode::kContractive, EdgeTerm::kSimilarity, TuplePolicy::kDense,
                      0xfd524d8bcedf4686U, 0x6b9f615ae2250c50U},
               Golden{DiffusionMode::kContractive, EdgeTerm::kLabel, TuplePolicy::kDense,
                      0x1a00af2a7fa76536U, 0xcc5663c94692d723U},
               Golden{DiffusionMode::kPaper, EdgeTerm::kNone, TuplePolicy::kDense,
                      0x69fbefc82230d128U, 0x7548017698a86127U},
               Golden{DiffusionMode::kNone, EdgeTerm::kNone, TuplePolicy::kCompact,
                      0xa868d6505ce310f4U, 0xf076b6c580ab202cU});
  Random random(73);
  GlobalMapConfig config = team_config(golden.tuple);
  config.diffusion.mode = golden.mode;
  config.diffusion.edge = golden.edge;
  config.diffusion.iterations = golden.mode == DiffusionMode::kPaper ? 2 : 6;
  config.diffusion.length_m = 0.25F;
  config.map.hash_seed = GENERATE(0U, 0x7e55e4aU);
  Team team(config);
  for (std::uint32_t i = 0; i < 4; ++i) {
    OracleContribution contribution;
    contribution.id = {i, 0, 0};
    contribution.voxels = random_voxels(random, 300, {0, 0, 0});
    if (i != 0) contribution.T_global_local = turned(12.0, i, 2.0 - i, 3.0 * i);
    team.publish(contribution, 1);
  }
  team.settle();
  CAPTURE(to_string(golden.mode), to_string(golden.edge), team.digest());
  CHECK(team.digest() == golden.digest);
  CHECK(digest_by_rows(team.global().map()) == golden.by_rows);
}

TEST_CASE("golden digest: of robots of which two are wrong, on every machine") {
  GlobalMapConfig config = team_config(TuplePolicy::kCompact);
  config.diffusion.iterations = 2;
  Team team(config);
  for (std::uint32_t robot = 0; robot < 5; ++robot) {
    OracleContribution one = striped_ground(robot, robot == 1   ? swapped
                                                   : robot == 3 ? permuted
                                                                : honestly);
    if (robot == 4) one.T_global_local = turned(12.0, 0.0, 0.0, 0.25);
    team.publish(one, 1);
  }
  team.settle();
  CHECK(team.global().reliability(1)->named != 0);
  CAPTURE(team.digest());
  CHECK(team.digest() == 0x51cf4ed1ec8caad9U);
}

}  // namespace
}  // namespace tessera::oracle
