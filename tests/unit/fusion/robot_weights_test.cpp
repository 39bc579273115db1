// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whom to believe: who is named, for which classes, and who is not.
#include "judged_blocks.hpp"

namespace tessera {
namespace {

TEST_CASE("RobotWeights: two classes taken for each other are named, and count nothing") {
  OwnWeights own;
  const Says swapped = [](unsigned truth) -> Label {
    return {truth == 1 ? 2U : truth == 2 ? 1U : truth};
  };
  add_all(own.weights, blocks_of({noisy(0.1, 1), swapped, noisy(0.1, 2)}));
  CHECK(own.update() == 0b010);
  CHECK(own.weights.report(1).named == classes({1, 2}));
  CHECK(own.weights.weights(1)[1] == 0.0F);
  CHECK(own.weights.weights(1)[2] == 0.0F);
  for (std::size_t c : {0U, 3U, 4U, 5U, 6U, 7U}) CHECK(own.weights.weights(1)[c] == 1.0F);
  for (const unsigned honest : {0U, 2U}) {
    CHECK(own.weights.report(honest).named == 0);
    CHECK(own.weights.all_one(honest));
  }
  CHECK(own.weights.report(1, 1).agreement < 0.1F);
  CHECK(own.weights.report(1, 3).agreement > 0.9F);
  CHECK(own.update() == 0);  // nothing new
}

TEST_CASE("RobotWeights: a robot whose classes are all others is named with all of them") {
  OwnWeights own;
  const Says permuted = [](unsigned truth) -> Label { return {truth % kWeighedClasses + 1}; };
  add_all(own.weights, blocks_of({permuted, noisy(0.1, 1), noisy(0.1, 2)}));
  CHECK(own.update() == 0b001);
  CHECK(own.weights.report(0).named == classes({1, 2, 3, 4, 5, 6}));
  CHECK(own.weights.report(0).reliability == 0.0F);
}

TEST_CASE("RobotWeights: half of the labels confused is named, a fifth drawn at random is not") {
  OwnWeights own;
  auto random = std::make_shared<oracle::Random>(7);
  const Says half = [random](unsigned truth) -> Label {
    return {random->below(2) == 0 ? truth : truth % kWeighedClasses + 1};
  };
  SECTION("half of the voxels") {
    add_all(own.weights, blocks_of({right, right, half}));
    CHECK(own.update() == 0b100);
    CHECK(own.weights.report(2).named == classes({1, 2, 3, 4, 5, 6}));
  }
  SECTION("half of the evidence of each voxel") {
    add_all(own.weights, blocks_of({right, right, [](unsigned truth) -> Label {
                                      return {truth, LabelTally::kUnits / 2};
                                    }}));
    CHECK(own.update() == 0b100);
    CHECK(own.weights.report(2).named != 0);
  }
  SECTION("three with noise of a fifth, in 100 seeds") {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      OwnWeights anew;
      add_all(anew.weights, blocks_of({noisy(0.2, 3 * seed), noisy(0.2, 3 * seed + 1),
                                       noisy(0.2, 3 * seed + 2)}));
      REQUIRE(anew.update() == 0);
      for (const unsigned robot : {0U, 1U, 2U}) REQUIRE(anew.weights.report(robot).named == 0);
    }
  }
}

TEST_CASE("RobotWeights: a class that is hard for all is held against nobody") {
  OwnWeights own;
  const auto unsure = [](std::uint64_t seed) -> Says {
    auto random = std::make_shared<oracle::Random>(seed);
    return [random](unsigned truth) -> Label {
      return {truth == 3 && random->uniform() < 0.4 ? 4U : truth};
    };
  };
  add_all(own.weights, blocks_of({unsure(1), unsure(2), unsure(3)}));
  CHECK(own.update() == 0);
}

TEST_CASE("RobotWeights: what few voxels or few blocks say is not enough") {
  OwnWeights own;
  const Says permuted = [](unsigned truth) -> Label { return {truth % kWeighedClasses + 1}; };
  add_all(own.weights, blocks_of({right, right, permuted}, RobotWeights::kLeastBlocks - 1));
  CHECK(own.update() == 0);
  CHECK(own.weights.report(2).judged != 0);
  add_all(own.weights, blocks_of({right, right, permuted}, 1));
  CHECK(own.update() == 0b100);
}

TEST_CASE("RobotWeights: two that differ are reported, and both count as they are") {
  OwnWeights own;
  for (int block = 0; block < 100; ++block)
    own.weights.add(std::vector<LabelTally>{LabelTally::of_pair(0, 1, 512, 500),
                                            LabelTally::of_pair(1, 2, 512, 500)});
  CHECK(own.update() == 0);
  for (const unsigned robot : {0U, 1U}) {
    const RobotReliability report = own.weights.report(robot);
    CHECK(report.shared == 51200);
    CHECK(report.differing == 50000);
    CHECK(report.judged == 0);
    CHECK(report.named == 0);
    CHECK(own.weights.all_one(robot));
  }
}

TEST_CASE("RobotWeights: a class that a robot never has is named, though its labels count") {
  OwnWeights own;
  const Says never_one = [](unsigned truth) -> Label { return {truth == 1 ? 2U : truth}; };
  auto blocks = blocks_of({noisy(0.05, 1), never_one, noisy(0.05, 2)});
  // Ten times as much of the class that it takes it for.
  for (int more = 0; more < 9; ++more) {
    const auto again = blocks_of({noisy(0.05, 3), never_one, noisy(0.05, 4)});
    for (std::size_t block = 20; block < 40; ++block) blocks.push_back(again[block]);
  }
  add_all(own.weights, blocks);
  CHECK(own.update() == 0);
  CHECK(own.weights.all_one(1));
  CHECK(own.weights.report(1).named == classes({1}));
  CHECK(own.weights.report(1, 1).agreement == 0.0F);
}

TEST_CASE("RobotWeights: what blocks say may come and go in any order") {
  oracle::Random random(17);
  const Says swapped = [](unsigned truth) -> Label {
    return {truth == 1 ? 2U : truth == 2 ? 1U : truth};
  };
  const auto now = blocks_of({noisy(0.2, 1), swapped, noisy(0.2, 2)});
  const auto before = blocks_of({swapped, noisy(0.3, 3), right});
  OwnWeights own;
  OwnWeights anew;
  add_all(anew.weights, now);
  static_cast<void>(anew.update());
  struct Change {
    const std::vector<LabelTally>* block;
    bool add;
  };
  std::vector<Change> changes;
  add_all(own.weights, before);
  for (const auto& block : now) changes.push_back({&block, true});
  for (const auto& block : before) changes.push_back({&block, false});
  for (std::size_t i = changes.size(); i > 1; --i)
    std::swap(changes[i - 1], changes[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
  for (const Change& change : changes) {
    change.add ? own.weights.add(*change.block) : own.weights.subtract(*change.block);
    if (random.below(4) == 0) static_cast<void>(own.update());
  }
  static_cast<void>(own.update());
  for (const unsigned robot : {0U, 1U, 2U}) {
    for (std::size_t c = 0; c < kWeighedComponents; ++c)
      CHECK(own.weights.weights(robot)[c] == anew.weights.weights(robot)[c]);
    CHECK(own.weights.report(robot).named == anew.weights.report(robot).named);
  }
}

TEST_CASE("RobotWeights: where nobody is to be weighed down all are named as else") {
  DiffusionConfig config;
  SECTION("by the setting") { config.weigh_robots = false; }
  SECTION("the paper's sum") { config.mode = DiffusionMode::kPaper; }
  SECTION("the plain sum") { config.mode = DiffusionMode::kNone; }
  OwnWeights own(4, config);
  const Says permuted = [](unsigned truth) -> Label { return {truth % kWeighedClasses + 1}; };
  add_all(own.weights, blocks_of({right, right, permuted}));
  CHECK(own.update() == 0);
  CHECK(own.weights.all_one(2));
  CHECK(own.weights.report(2).named == classes({1, 2, 3, 4, 5, 6}));
}

}  // namespace
}  // namespace tessera
