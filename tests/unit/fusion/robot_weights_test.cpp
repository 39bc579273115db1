// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whom to believe: who is named, for which classes, and who is not.
#include "tessera/fusion/internal/robot_weights.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

constexpr int kWeighedClasses = 6;
constexpr int kWeighedComponents = kWeighedClasses + 2;

struct OwnWeights {
  explicit OwnWeights(std::uint32_t robots = 4, const DiffusionConfig& config = {})
      : memory(RobotWeights::required_bytes(robots, kWeighedComponents)) {
    Arena arena = memory.arena();
    weights = *RobotWeights::make(arena, robots, kWeighedComponents, config);
    CHECK(arena.remaining_bytes() == 0);
  }
  std::uint64_t update() {
    std::uint64_t work = 0;
    return weights.update(work);
  }
  AlignedMemory memory;
  RobotWeights weights;
};

/// What a robot says of a voxel that truly is of a class, and how much of its evidence.
struct Label {
  unsigned label = 0;
  unsigned units = LabelTally::kUnits;
};
using Says = std::function<Label(unsigned truth)>;

/// Blocks of 60 voxels of a class each, as robots that say so have them: the majority is right
/// where two of three are.
std::vector<std::vector<LabelTally>> blocks_of(const std::vector<Says>& robots,
                                               unsigned blocks_of_class = 20) {
  constexpr unsigned kVoxels = 60;
  std::vector<std::vector<LabelTally>> blocks;
  for (unsigned truth = 1; truth <= kWeighedClasses; ++truth) {
    for (unsigned block = 0; block < blocks_of_class; ++block) {
      constexpr std::size_t kLabels = kWeighedClasses + 1;
      std::vector<unsigned> units(robots.size() * kLabels * kLabels);
      const auto at = [&](std::size_t robot, unsigned majority, unsigned label) -> unsigned& {
        return units[(robot * kLabels + majority) * kLabels + label];
      };
      for (unsigned voxel = 0; voxel < kVoxels; ++voxel) {
        std::vector<Label> labels;
        std::vector<int> votes(kLabels);
        for (const Says& says : robots) ++votes[labels.emplace_back(says(truth)).label];
        const auto most = std::max_element(votes.begin(), votes.end());
        if (*most < 2 || std::count(votes.begin(), votes.end(), *most) > 1) continue;
        const auto majority = static_cast<unsigned>(most - votes.begin());
        for (std::size_t robot = 0; robot < labels.size(); ++robot) {
          at(robot, majority, labels[robot].label) += labels[robot].units;
          at(robot, majority, 0) += LabelTally::kUnits - labels[robot].units;
        }
      }
      std::vector<LabelTally>& tallies = blocks.emplace_back();
      for (unsigned robot = 0; robot < robots.size(); ++robot) {
        for (unsigned majority = 1; majority < kLabels; ++majority) {
          for (unsigned label = 0; label < kLabels; ++label) {
            if (const unsigned sum = at(robot, majority, label); sum != 0)
              tallies.push_back(LabelTally::of_majority(robot, majority, label, sum));
          }
        }
      }
    }
  }
  return blocks;
}

void add_all(RobotWeights& weights, const std::vector<std::vector<LabelTally>>& blocks) {
  for (const std::vector<LabelTally>& block : blocks) weights.add(block);
}

Label right(unsigned truth) { return {truth}; }

/// That share of its labels drawn evenly from all.
Says noisy(double share, std::uint64_t seed) {
  auto random = std::make_shared<oracle::Random>(seed);
  return [random, share](unsigned truth) -> Label {
    const bool wrong = random->uniform() < share;
    return {wrong ? 1U + static_cast<unsigned>(random->below(kWeighedClasses)) : truth};
  };
}

constexpr std::uint64_t classes(std::initializer_list<unsigned> labels) {
  std::uint64_t bits = 0;
  for (const unsigned label : labels) bits |= std::uint64_t{1} << label;
  return bits;
}

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
