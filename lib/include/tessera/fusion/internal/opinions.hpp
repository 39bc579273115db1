// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which label each robot gives each voxel of a block, and what that says of every one of them: the
// others are asked where a robot is right (docs/design/theory.md, Whom to believe).
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "tessera/fusion/internal/label_tally.hpp"
#include "tessera/map/block_content.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

class Opinions {
 public:
  /// Of one block. Where it would have more, robots with higher numbers are left out.
  static constexpr std::size_t kMostTallies = 4096;

  /// robots: at most.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t robots,
                                                            int num_components) noexcept {
    return arena_bytes<Opinion>(robots) + arena_bytes<Scratch>(1) +
           arena_bytes<std::uint16_t>(cells(num_components)) +
           arena_bytes<LabelTally>(kMostTallies);
  }
  /// num_components: C + 2; free_weight: as MapConfig has it. Fails with kResourceExhausted iff the
  /// arena is too small.
  [[nodiscard]] static Result<Opinions> make(Arena& arena, std::uint32_t robots, int num_components,
                                             float free_weight) noexcept;
  /// Has no opinion, and takes none.
  Opinions() noexcept = default;

  /// Begins with a block of which no robot has said anything. O(1).
  void begin_block() noexcept { count_ = 0; }
  /// A robot's voxels: where its label evidence outweighs its free passes, the class with the most
  /// of it counts. By ascending number of the robot. O(512 * components).
  void add(unsigned robot_bit, const BlockContent& content) noexcept;
  /// Robots with a label in the block.
  [[nodiscard]] std::size_t robots() const noexcept { return count_; }
  /// What the block says of each, until the next block begins. O(512 robots + robots * classes^2).
  [[nodiscard]] std::span<const LabelTally> tally() noexcept;

 private:
  struct Opinion {
    unsigned robot_bit = 0;
    std::array<std::uint8_t, kBlockVoxels> label{};  ///< 0: none.
    std::array<std::uint8_t, kBlockVoxels> units{};  ///< Its share of the label evidence.
  };
  struct Scratch {
    std::array<float, kBlockVoxels> most{};
    std::array<int, kBlockVoxels> label{};          ///< Of the robot at hand.
    std::array<float, kBlockVoxels> labels{};       ///< Evidence of all classes.
    std::array<std::uint8_t, kBlockVoxels> said{};  ///< How many robots have a label.
    /// The class that is judged by; 0: none.
    std::array<std::uint8_t, kBlockVoxels> majority{};
    std::array<std::uint8_t, kMaxComponents> votes{};
  };
  /// Units by the majority's class and the robot's; then voxels of pairs, and differing ones. Of
  /// two robots four numbers by class.
  [[nodiscard]] static constexpr std::size_t cells(int num_components) noexcept {
    const auto labels = static_cast<std::size_t>(num_components - 1);
    return labels * (labels + 2);
  }
  [[nodiscard]] bool decide(Opinion& one, std::size_t at, const BlockContent& content) noexcept;
  [[nodiscard]] std::size_t tally_pair() noexcept;
  void find_majorities() noexcept;
  [[nodiscard]] unsigned majority_of(std::size_t row) noexcept;
  [[nodiscard]] bool differs(std::size_t row) const noexcept;
  [[nodiscard]] bool add_tallies(const Opinion& one, std::size_t& size) noexcept;

  std::span<Opinion> opinions_;
  std::size_t count_ = 0;
  Scratch* scratch_ = nullptr;
  std::span<std::uint16_t> cells_;
  std::span<LabelTally> tallies_;
  std::size_t labels_ = 0;  ///< C + 1: 0 and the classes.
  float free_weight_ = 0.0F;
};

}  // namespace tessera
