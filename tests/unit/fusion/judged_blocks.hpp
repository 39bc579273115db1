// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What blocks say of robots that label by a rule, and weights in memory of exactly their size.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/fusion/internal/robot_weights.hpp"

namespace tessera {

inline constexpr int kWeighedClasses = 6;
inline constexpr int kWeighedComponents = kWeighedClasses + 2;

struct OwnWeights {
  explicit OwnWeights(std::uint32_t robots = 4, const DiffusionConfig& config = {})
      : memory(RobotWeights::required_bytes(robots, kWeighedComponents)) {
    Arena arena = memory.arena();
    weights = *RobotWeights::make(arena, robots, kWeighedComponents, config);
    CHECK(arena.remaining_bytes() == 0);
  }
  /// The robots whose weights changed, a bit each.
  std::uint64_t update() {
    std::uint64_t work = 0;
    return weights.update(work).robots;
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
inline std::vector<std::vector<LabelTally>> blocks_of(const std::vector<Says>& robots,
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

inline void add_all(RobotWeights& weights, const std::vector<std::vector<LabelTally>>& blocks) {
  for (const std::vector<LabelTally>& block : blocks) weights.add(block);
}

inline Label right(unsigned truth) { return {truth}; }

/// That share of its labels drawn evenly from all.
inline Says noisy(double share, std::uint64_t seed) {
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

}  // namespace tessera
