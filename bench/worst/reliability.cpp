// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whom to believe, with as many robots and classes as there can be, all in one block, of whom no
// two agree for long.
#include <array>
#include <vector>

#include "meter.hpp"
#include "tessera/fusion/internal/opinions.hpp"
#include "tessera/fusion/internal/robot_weights.hpp"

namespace tessera::bench {

namespace {

constexpr int kComponents = kMostClasses + 2;
constexpr std::uint32_t kRobots = Replicas::kMostRobots;

template <class Made>
struct OwnedByRobots {
  OwnedByRobots()
      : lines(Made::required_bytes(kRobots, kComponents) / sizeof(OwnedMap::Line) + 1) {}
  [[nodiscard]] Arena arena() { return Arena(std::as_writable_bytes(std::span(lines))); }
  std::vector<OwnedMap::Line> lines;
};

/// Of each robot another class in each voxel, but those that are more than classes say the same.
void fill(BlockContent& content, unsigned robot) {
  content.clear();
  if (robot >= static_cast<unsigned>(kMostClasses)) robot = 0;
  for (int row = 0; row < kBlockVoxels; ++row)
    content.add(1 + (row + static_cast<int>(robot)) % kMostClasses, row, 2.0F);
}

}  // namespace

void measure_reliability(Meter& meter) {
  std::vector<OwnedMap::Line> lines(
      BlockContent::required_bytes(kComponents) / sizeof(OwnedMap::Line) + 1);
  Arena content_arena(std::as_writable_bytes(std::span(lines)));
  BlockContent content = *BlockContent::make(content_arena, kComponents);
  OwnedByRobots<Opinions> own;
  Arena arena = own.arena();
  Opinions opinions = *Opinions::make(arena, kRobots, kComponents, 0.4F);
  const auto speak = [&] {
    opinions.begin_block();
    for (unsigned robot = 0; robot < kRobots; ++robot) {
      fill(content, robot);
      opinions.add(robot, content);
    }
  };
  meter.measure({"tally", "Opinions::tally", "64 robots with a label in every voxel of a block",
                 "512 robots + robots (C + 1)^2"},
                1, speak, [&] {
                  constexpr double kCells = kRobots * (kMostClasses + 1.0) * (kMostClasses + 1.0);
                  return fixed(!opinions.tally().empty(), 512.0 * kRobots + kCells);
                });
  OwnedByRobots<RobotWeights> own_weights;
  Arena weights_arena = own_weights.arena();
  RobotWeights weights = *RobotWeights::make(weights_arena, kRobots, kComponents, {});
  speak();
  const std::span<const LabelTally> tallies = opinions.tally();
  for (unsigned robot = 0; robot < kRobots; ++robot) {
    for (unsigned label = 1; label <= kMostClasses; ++label) {
      for (int block = 0; block < 8; ++block)
        weights.add(std::array{LabelTally::of_majority(robot, label, label, 1500),
                               LabelTally::of_majority(robot, label, 1 + label % 7, 900)});
    }
  }
  meter.measure(
      {"weigh_robots", "GlobalMap::step", "64 robots that are judged in every class are weighed",
       "robots (C + 1)^2"},
      1, [&] { weights.add(tallies); },
      [&] {
        std::uint64_t work = 0;
        static_cast<void>(weights.update(work));
        return Operations{static_cast<double>(work),
                          kRobots * (kMostClasses + 1.0) * (kMostClasses + 1.0)};
      });
}

}  // namespace tessera::bench
