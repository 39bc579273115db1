// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Random maps, ticks, budgets and refusals: when all is quiet, what is published means what the map
// means; and the same calls give the same publications.
#include <catch2/catch.hpp>

#include "sample_robot.hpp"
#include "support/random.hpp"

namespace tessera {

namespace {

/// Some changes of all kinds; weights are whole, so that sums are exact.
void change(SampleRobot& robot, oracle::Random& random) {
  const int count = random.below(60);
  for (int n = 0; n < count; ++n) {
    const VoxelCoord voxel{random.below(160) - 80, random.below(64) - 32, random.below(16) - 8};
    const int what = random.below(16);
    if (what < 9) {
      REQUIRE(hit(robot.map(), voxel, 1 + random.below(4),
                  static_cast<float>(1 + random.below(3))) == Status::kOk);
    } else if (what < 15) {
      for (int i = 0; i < 4; ++i) REQUIRE(carve(robot.map(), voxel) == Status::kOk);
    } else if (const SlabHandle at = robot.map().find_handle(block_of(voxel)); at != 0) {
      robot.map().remove_block(at);
    }
  }
}

PublisherConfig random_config(oracle::Random& random) {
  PublisherConfig config;
  config.blocks = 4096;
  config.candidates = random.below(2) == 0 ? 64 : 4096;
  config.many_voxels = static_cast<std::uint32_t>(1 + random.below(64));
  config.few_voxels = random.below(2) == 0 ? 1 : static_cast<std::uint32_t>(1 + random.below(8));
  config.near_blocks = random.below(8);
  config.evidence_factor = 1.5F + static_cast<float>(random.below(4));
  return config;
}

std::vector<std::uint64_t> log_of(std::uint64_t seed) {
  oracle::Random random(seed);
  SampleRobot robot(random_config(random), 2048);
  const std::uint32_t compared = static_cast<std::uint32_t>(1 + random.below(100));
  for (int i = 0; i < 60; ++i) {
    if (random.below(3) != 0) change(robot, random);
    if (random.below(8) == 0) robot.publisher.set_focus({random.below(20) - 10, 0, 0});
    robot.budget.compared = compared;
    robot.budget.entries = random.below(2) == 0 ? 512 : 65536;
    robot.budget.label_bytes = static_cast<std::uint32_t>(random.below(3000));
    robot.kept.refuses = random.below(10) == 0;
    robot.tick(1 + random.below(100'000));
  }
  robot.kept.refuses = false;
  robot.budget = kPlenty;
  CAPTURE(seed);
  REQUIRE(robot.settles(400));
  CHECK(robot.disagreement() == 0);
  return robot.kept.log;
}

}  // namespace

TEST_CASE("Publisher: when all is quiet, what is published means what the map means") {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) log_of(seed);
}

TEST_CASE("Publisher: the same calls give the same publications in the same order") {
  for (std::uint64_t seed = 100; seed < 105; ++seed) CHECK(log_of(seed) == log_of(seed));
}

}  // namespace tessera
