// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a count of a robot's labels of each class counts, by what all blocks say of it
// (docs/design/theory.md, Whom to believe). Sums of whole numbers, so that the order in which
// blocks change is no matter.
#pragma once

#include <span>

#include "tessera/fusion/diffusion_config.hpp"
#include "tessera/fusion/internal/label_tally.hpp"
#include "tessera/fusion/reliability.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

class RobotWeights {
 public:
  /// Steps from 0 to 1.
  static constexpr int kSteps = 16;
  /// A class is judged by so many voxels in so many blocks: voxels of one surface err alike.
  static constexpr std::uint64_t kLeastVoxels = 100;
  static constexpr std::uint32_t kLeastBlocks = 8;
  static constexpr std::size_t kMostChanged = 4096;
  /// A class that a robot has so much less often than the others is named, whatever it says
  /// instead.
  static constexpr double kLeastAgreement = 0.1;

  /// robots: at most.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t robots,
                                                            int num_components) noexcept {
    return (std::size_t{robots} + 1) * arena_bytes<std::uint64_t>(cells(num_components)) +
           robots * arena_bytes<float>(static_cast<std::size_t>(num_components)) +
           arena_bytes<Robot>(robots) +
           arena_bytes<double>(static_cast<std::size_t>(num_components));
  }
  /// num_components: C + 2. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<RobotWeights> make(Arena& arena, std::uint32_t robots,
                                                 int num_components,
                                                 const DiffusionConfig& config) noexcept;
  RobotWeights() noexcept = default;

  /// What a block says, or what it said before. O(tallies).
  void add(std::span<const LabelTally> tallies) noexcept { change<true>(tallies); }
  void subtract(std::span<const LabelTally> tallies) noexcept { change<false>(tallies); }
  /// Whether anything was added or subtracted since the last update.
  [[nodiscard]] bool changed() const noexcept { return changed_ != 0; }
  /// Whether that is so much that it should not wait for more.
  [[nodiscard]] bool overdue() const noexcept { return changed_ > kMostChanged + held_ / 4; }
  /// What an update has changed, a bit each.
  struct Changed {
    std::uint64_t robots = 0;
    std::uint64_t classes = 0;  ///< Of any of them.
  };
  /// Weighs all robots anew: those whose weights are others than before. work: grows by what it
  /// costs. O(most robots * classes^2).
  [[nodiscard]] Changed update(std::uint64_t& work) noexcept;

  /// By components, 0 .. C + 1, that of what is no class always 1; by robot_bit.
  [[nodiscard]] std::span<const float> weights(unsigned robot) const noexcept {
    return robots_[robot].weights;
  }
  /// Whether all that a robot says counts as it is.
  [[nodiscard]] bool all_one(unsigned robot) const noexcept {
    return !weighs_ || robots_[robot].all_one;
  }
  /// As of the last update, but for the numbers of voxels. O(classes).
  [[nodiscard]] RobotReliability report(unsigned robot) const noexcept;
  [[nodiscard]] ClassReliability report(unsigned robot, int label) const noexcept;

 private:
  struct Robot {
    std::span<std::uint64_t> sums;
    std::span<float> weights;
    std::uint64_t named = 0;
    float as_a_whole = 1.0F;
    bool all_one = true;
  };
  /// Units by the majority's class and the robot's, then by classes: units of all that it has
  /// where that is the majority's, blocks, voxels shared with one other, and differing ones.
  [[nodiscard]] static constexpr std::size_t cells(int num_components) noexcept {
    const auto labels = static_cast<std::size_t>(num_components - 1);
    return labels * (labels + 4);
  }
  template <bool kAdd>
  void change(std::span<const LabelTally> tallies) noexcept;
  [[nodiscard]] static double number(const std::span<std::uint64_t>& sums,
                                     std::size_t at) noexcept {
    return static_cast<double>(sums[at]);
  }
  [[nodiscard]] std::size_t row_sum(std::size_t label) const noexcept {
    return labels_ * labels_ + label;
  }
  [[nodiscard]] std::size_t blocks_at(std::size_t label) const noexcept {
    return labels_ * (labels_ + 1) + label;
  }
  [[nodiscard]] std::size_t shared_at(std::size_t label) const noexcept {
    return labels_ * (labels_ + 2) + label;
  }
  [[nodiscard]] std::size_t differing_at(std::size_t label) const noexcept {
    return labels_ * (labels_ + 3) + label;
  }
  [[nodiscard]] bool is_judged(const Robot& robot, std::size_t label) const noexcept;
  [[nodiscard]] double relative_agreement(const Robot& robot, std::size_t label) const noexcept;
  [[nodiscard]] double likely_right(const Robot& robot, std::size_t label,
                                    double hit) const noexcept;
  [[nodiscard]] double agreement_of(const Robot& robot) const noexcept;
  /// The classes whose weights are others than before.
  [[nodiscard]] std::uint64_t weigh(Robot& robot) noexcept;

  [[nodiscard]] double claimed(const Robot& robot, std::size_t label) const noexcept;

  std::span<Robot> robots_;       ///< By robot_bit.
  std::span<std::uint64_t> all_;  ///< As Robot::sums, of all together.
  std::span<double> right_;       ///< Of the robot at hand, by classes: how likely it is right.
  std::size_t labels_ = 0;        ///< C + 1: 0 and the classes.
  bool weighs_ = true;
  std::size_t held_ = 0;     ///< Tallies that are added and not subtracted.
  std::size_t changed_ = 0;  ///< Tallies, since the last update.
  float alarm_ = 0.0F;
};

}  // namespace tessera
