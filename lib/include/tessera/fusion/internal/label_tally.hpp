// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one block says of a robot's labels: how often, and with how much of its evidence, it has a
// class where others have one. Four bytes, so that blocks can keep what they said.
#pragma once

#include <cstdint>

namespace tessera {

class LabelTally {
 public:
  static constexpr unsigned kUnits = 15;  ///< Of a voxel's label evidence.

  constexpr LabelTally() noexcept = default;
  /// Voxels in which the majority of three robots or more has a class: of this robot's label
  /// evidence there so many units are of the class that it has; said 0: of all others.
  [[nodiscard]] static constexpr LabelTally of_majority(unsigned robot, unsigned majority,
                                                        unsigned said, unsigned units) noexcept {
    return LabelTally(robot | (majority << 6U) | (said << 12U) | (units << 18U));
  }
  /// Voxels, from 1, to which this robot gives a label and one other alone does, which in some of
  /// them differs.
  [[nodiscard]] static constexpr LabelTally of_pair(unsigned robot, unsigned label, unsigned voxels,
                                                    unsigned differing) noexcept {
    return LabelTally(robot | (label << 6U) | ((voxels - 1U) << 12U) | (differing << 21U) | kPair);
  }

  [[nodiscard]] constexpr bool is_of_pair() const noexcept { return (bits_ & kPair) != 0; }
  /// As Replicas::Contribution::robot_bit.
  [[nodiscard]] constexpr unsigned robot() const noexcept { return bits_ & 63U; }
  /// The majority's class, or of a pair the robot's own.
  [[nodiscard]] constexpr unsigned label() const noexcept { return (bits_ >> 6U) & 63U; }
  [[nodiscard]] constexpr unsigned said() const noexcept { return (bits_ >> 12U) & 63U; }
  [[nodiscard]] constexpr unsigned units() const noexcept { return (bits_ >> 18U) & 0x1fffU; }
  [[nodiscard]] constexpr unsigned voxels() const noexcept { return 1U + ((bits_ >> 12U) & 511U); }
  [[nodiscard]] constexpr unsigned differing() const noexcept { return (bits_ >> 21U) & 1023U; }
  friend constexpr bool operator==(LabelTally, LabelTally) noexcept = default;

 private:
  static constexpr std::uint32_t kPair = 1U << 31U;
  constexpr explicit LabelTally(std::uint32_t bits) noexcept : bits_(bits) {}

  std::uint32_t bits_ = 0;
};

}  // namespace tessera
