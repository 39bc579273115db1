// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The frame of a submap whose poses were corrected: the rigid transform that takes the poses with
// which it was mapped to the corrected ones, as near as one transform can.
#pragma once

#include <cstdint>

#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

/// Collects pairs of poses. Rotation: the mean of those from each pose to its correction, as
/// quaternions (Markley et al., Averaging Quaternions, JGCD 2007, for rotations that are near each
/// other); translation: what takes the mean of the places to that of the corrected ones under it.
class FrameFit {
 public:
  /// mapped: T_map_sensor as the scan was integrated; corrected: T_world_sensor. Both rigid. O(1).
  void add(const Matrix34d& mapped, const Matrix34d& corrected) noexcept;
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  /// T_world_map. Fails with kInvalidArgument iff there is no pair, or the rotations contradict
  /// each other: their mean is under half as long as each. O(1).
  [[nodiscard]] Result<Matrix34d> fit() const noexcept;

 private:
  Quaternion rotations_{};
  Point3d mapped_ = Point3d::Zero();
  Point3d corrected_ = Point3d::Zero();
  std::uint32_t count_ = 0;
};

}  // namespace tessera
