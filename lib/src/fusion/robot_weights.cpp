// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/robot_weights.hpp"

#include <algorithm>

namespace tessera {

namespace {

constexpr std::uint64_t kUnits = LabelTally::kUnits;

/// Evidence of a class that is right so often counts nothing, and all of it. Between: in
/// proportion.
struct Ramp {
  double nothing;
  double all;
  [[nodiscard]] constexpr double operator()(double x) const noexcept {
    return std::clamp((x - nothing) / (all - nothing), 0.0, 1.0);
  }
};
constexpr Ramp kOfClass{0.2, 0.7};
constexpr Ramp kOfRobot{0.55, 0.75};
/// Voxels in which a claim is taken to be right before any is seen.
constexpr double kRightBefore = 30.0 * LabelTally::kUnits;

}  // namespace

Result<RobotWeights> RobotWeights::make(Arena& arena, std::uint32_t robots, int num_components,
                                        const DiffusionConfig& config) noexcept {
  RobotWeights made;
  const auto components = static_cast<std::size_t>(num_components);
  made.labels_ = components - 1;
  made.weighs_ = config.weigh_robots && config.mode == DiffusionMode::kContractive;
  made.alarm_ = config.reliability_alarm;
  made.all_ = arena.take<std::uint64_t>(cells(num_components));
  made.right_ = arena.take<double>(components);
  made.robots_ = arena.take<Robot>(robots);
  bool complete = !made.all_.empty() && !made.right_.empty() && !made.robots_.empty();
  for (Robot& robot : made.robots_) {
    robot.sums = arena.take<std::uint64_t>(cells(num_components));
    robot.weights = arena.take<float>(components);
    complete = complete && !robot.sums.empty() && !robot.weights.empty();
    std::fill(robot.weights.begin(), robot.weights.end(), 1.0F);
  }
  if (!complete) return Status::kResourceExhausted;
  return made;
}

template <bool kAdd>
void RobotWeights::change(std::span<const LabelTally> tallies) noexcept {
  const auto by = [](std::uint64_t& sum, std::uint64_t amount) {
    sum = kAdd ? sum + amount : sum - amount;
  };
  changed_ += tallies.size();
  held_ = kAdd ? held_ + tallies.size() : held_ - tallies.size();
  std::uint64_t before = ~std::uint64_t{0};  // robot and majority, whose tallies are neighbours
  for (const LabelTally tally : tallies) {
    const std::size_t label = tally.label();
    for (const std::span<std::uint64_t> sums : {robots_[tally.robot()].sums, all_}) {
      if (tally.is_of_pair()) {
        by(sums[shared_at(label)], tally.voxels());
        by(sums[differing_at(label)], tally.differing());
        continue;
      }
      by(sums[label * labels_ + tally.said()], tally.units());
      by(sums[row_sum(label)], tally.units());
      if (before != (tally.robot() << 6U | label)) by(sums[blocks_at(label)], 1);
    }
    if (!tally.is_of_pair()) before = tally.robot() << 6U | label;
  }
}
template void RobotWeights::change<true>(std::span<const LabelTally>) noexcept;
template void RobotWeights::change<false>(std::span<const LabelTally>) noexcept;

bool RobotWeights::is_judged(const Robot& robot, std::size_t label) const noexcept {
  return robot.sums[row_sum(label)] >= kLeastVoxels * kUnits &&
         robot.sums[blocks_at(label)] >= kLeastBlocks;
}

/// How often it has the majority's class, over how often the others have it; 1 at most, so that
/// what is hard to tell is held against nobody.
double RobotWeights::relative_agreement(const Robot& robot, std::size_t label) const noexcept {
  const std::size_t hit = label * labels_ + label;
  const double own = number(robot.sums, hit) / number(robot.sums, row_sum(label));
  const auto others = static_cast<double>(all_[row_sum(label)] - robot.sums[row_sum(label)]);
  const auto others_hit = static_cast<double>(all_[hit] - robot.sums[hit]);
  return own * others < others_hit ? own * others / others_hit : 1.0;
}

/// Units of its labels of the class, wherever there is a majority.
double RobotWeights::claimed(const Robot& robot, std::size_t label) const noexcept {
  std::uint64_t units = 0;
  for (std::size_t majority = 1; majority < labels_; ++majority)
    units += robot.sums[majority * labels_ + label];
  return static_cast<double>(units);
}

/// How likely a label of it is right: were all classes equally frequent, or as frequent as they
/// are, whichever is more. hit: how often it has the class where the majority has.
double RobotWeights::likely_right(const Robot& robot, std::size_t label,
                                  double hit) const noexcept {
  double wrong = 0.0;
  for (std::size_t majority = 1; majority < labels_; ++majority) {
    if (majority != label && is_judged(robot, majority))
      wrong +=
          number(robot.sums, majority * labels_ + label) / number(robot.sums, row_sum(majority));
  }
  const double right = number(robot.sums, label * labels_ + label);
  const double as_frequent = (right + kRightBefore) / (claimed(robot, label) + kRightBefore);
  const double equally = hit + wrong > 0.0 ? hit / (hit + wrong) : 1.0;
  return std::max(as_frequent, equally);
}

/// Agreement over all judged classes, by how many voxels they have; those whose claims are known to
/// be wrong are left out, for they are weighed alone, as long as others are left.
double RobotWeights::agreement_of(const Robot& robot) const noexcept {
  double voxels = 0.0;
  double agreed = 0.0;
  double sound_voxels = 0.0;
  double sound_agreed = 0.0;
  for (std::size_t label = 1; label < labels_; ++label) {
    if (!is_judged(robot, label)) continue;
    const double n = number(robot.sums, row_sum(label));
    const double agreement = relative_agreement(robot, label);
    const double sound = kOfClass(right_[label]);
    voxels += n;
    agreed += n * agreement;
    sound_voxels += n * sound;
    sound_agreed += n * sound * agreement;
  }
  if (!(voxels > 0.0)) return 1.0;
  return 8.0 * sound_voxels >= voxels ? sound_agreed / sound_voxels : agreed / voxels;
}

std::uint64_t RobotWeights::weigh(Robot& robot) noexcept {
  for (std::size_t label = 1; label < labels_; ++label) {
    const double n = number(robot.sums, row_sum(label));
    right_[label] =
        is_judged(robot, label)
            ? likely_right(robot, label, number(robot.sums, label * labels_ + label) / n)
            : 1.0;
  }
  const double agreement = agreement_of(robot);
  const double whole = kOfRobot(agreement);
  robot.as_a_whole = static_cast<float>(whole);
  robot.all_one = true;
  robot.named = 0;
  std::uint64_t changed = 0;
  for (std::size_t label = 1; label < labels_; ++label) {
    // Of a class that is hardly ever the majority's, the robot is taken to be as good as else.
    if (!is_judged(robot, label)) right_[label] = likely_right(robot, label, agreement);
    const double weight = std::min(kOfClass(right_[label]), whole);
    const int steps = floor_to_int(weight * kSteps + 0.5);
    const float rounded = static_cast<float>(steps) / kSteps;
    const std::uint64_t bit = std::uint64_t{1} << label;
    if (rounded != robot.weights[label]) changed |= bit;
    robot.weights[label] = rounded;
    robot.all_one = robot.all_one && steps == kSteps;
    if (alarm_ > 0.0F && is_judged(robot, label) &&
        relative_agreement(robot, label) < kLeastAgreement)
      robot.named |= bit;
    const bool has_it = robot.sums[row_sum(label)] != 0 || claimed(robot, label) > 0.0;
    if (has_it && rounded < alarm_) robot.named |= bit;
  }
  return changed;
}

RobotWeights::Changed RobotWeights::update(std::uint64_t& work) noexcept {
  changed_ = 0;
  Changed changed;
  for (std::size_t robot = 0; robot < robots_.size(); ++robot) {
    work += labels_ * labels_;
    const std::uint64_t classes = weigh(robots_[robot]);
    if (classes == 0 || !weighs_) continue;
    changed.robots |= std::uint64_t{1} << robot;
    changed.classes |= classes;
  }
  return changed;
}

RobotReliability RobotWeights::report(unsigned robot) const noexcept {
  const Robot& one = robots_[robot];
  RobotReliability report;
  std::uint64_t agreed = 0;
  std::uint64_t units = 0;
  for (std::size_t label = 1; label < labels_; ++label) {
    units += one.sums[row_sum(label)];
    agreed += one.sums[label * labels_ + label];
    report.shared += one.sums[shared_at(label)];
    report.differing += one.sums[differing_at(label)];
  }
  report.judged = units / kUnits;
  if (units != 0)
    report.agreement = static_cast<float>(static_cast<double>(agreed) / static_cast<double>(units));
  report.reliability = one.as_a_whole;
  report.named = one.named;
  return report;
}

ClassReliability RobotWeights::report(unsigned robot, int label) const noexcept {
  const Robot& one = robots_[robot];
  const auto at = static_cast<std::size_t>(label);
  ClassReliability report;
  const std::uint64_t units = one.sums[row_sum(at)];
  report.judged = units / kUnits;
  if (units != 0)
    report.agreement =
        static_cast<float>(number(one.sums, at * labels_ + at) / static_cast<double>(units));
  report.reliability = one.weights[at];
  return report;
}

}  // namespace tessera
