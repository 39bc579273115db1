// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far a robot's labels can be relied on, by what the other robots say of the same voxels
// (docs/design/theory.md, Whom to believe).
#pragma once

#include <cstdint>

namespace tessera {

/// One robot's labels where others have labels too.
struct RobotReliability {
  std::uint32_t robot = 0;
  /// Voxels in which three robots or more have a label, this one among them, and a majority of them
  /// the same. Without any there is nobody to judge it, and nothing is weighed down.
  std::uint64_t judged = 0;
  float agreement = 1.0F;       ///< Share of its label evidence there that is the majority's.
  std::uint64_t shared = 0;     ///< Voxels in which one other robot alone has a label.
  std::uint64_t differing = 0;  ///< Of these, those with another label. Nobody can know whose.
  /// Of its labels as a whole, 0 .. 1: what a count of them counts at most, where robots are
  /// weighed.
  float reliability = 1.0F;
  /// Classes with less than the alarm, or that it hardly ever has where most others do; a bit each.
  std::uint64_t named = 0;
};

/// One class of a robot.
struct ClassReliability {
  std::uint64_t judged = 0;  ///< Voxels of the majority's class.
  float agreement = 1.0F;    ///< Share of the robot's label evidence there that is of the class.
  /// Of its labels of the class, 0 .. 1: what a count of them counts, where robots are weighed.
  float reliability = 1.0F;
};

}  // namespace tessera
