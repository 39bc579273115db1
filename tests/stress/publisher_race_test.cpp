// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One thread writes to a map while another publishes it. No change may be missed: when the writer
// has ended and nothing waits, what is published means what the map means.
#include <thread>

#include "race.hpp"
#include "unit/exchange/sample_robot.hpp"

namespace tessera {
namespace {

/// Blocks that are opened, changed and removed: more than a page of the index holds, so that pages
/// are split under the publisher's eyes.
void write_round(LocalMap& map, oracle::Random& random) {
  for (int n = 0; n < 200; ++n) {
    const int x = random.below(16000);
    const int y = random.below(16);
    const VoxelCoord voxel{x - 8000, y - 8, 3};
    const int what = random.below(16);
    if (what < 10) {
      const int label = 1 + random.below(3);
      REQUIRE(hit(map, voxel, label, 2.0F) == Status::kOk);
    } else if (what < 14) {
      for (int i = 0; i < 4; ++i) REQUIRE(carve(map, voxel) == Status::kOk);
    } else if (const SlabHandle at = map.find_handle(block_of(voxel)); at != 0) {
      map.remove_block(at);
    }
  }
}

TEST_CASE("publisher: beside a thread that writes to the map it misses no change") {
  const std::uint64_t seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  PublisherConfig config;
  config.blocks = 1U << 14U;
  // With few candidates it stops within pages.
  config.candidates = GENERATE(1U << 14U, 64U);
  config.staleness_us = 200'000;
  config.free_staleness_us = 400'000;
  SampleRobot robot(config, 8192);
  robot.budget.entries = MapReader::kPageBlocks;
  std::atomic<bool> ended{false};
  std::thread writer([&] {
    oracle::Random random(seed);
    for (int round = 0; round < (kSlow ? 60 : 400); ++round) write_round(robot.map(), random);
    ended = true;
  });
  std::uint64_t beside = 0;
  while (!ended) beside += robot.tick().published;
  writer.join();
  CHECK(robot.map().index().slots() > MapReader::kPageBlocks);
  robot.budget.entries = kPlenty.entries;
  REQUIRE(robot.settles(2000));
  CHECK(robot.disagreement() == 0);
  CHECK(beside > 0);
}

TEST_CASE("publisher: a map that is cleared beside it is published as emptied") {
  SampleRobot robot({}, 2048);
  std::atomic<bool> ended{false};
  std::thread writer([&] {
    oracle::Random random(3);
    for (int round = 0; round < 30; ++round) {
      write_round(robot.map(), random);
      if (round % 5 == 4) robot.map().clear();
    }
    ended = true;
  });
  while (!ended) robot.tick();
  writer.join();
  REQUIRE(robot.settles(400));
  CHECK(robot.disagreement() == 0);
  CHECK(robot.kept.blocks.empty());
}

}  // namespace
}  // namespace tessera
