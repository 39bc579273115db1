// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Makes a pose of the bytes on the bus: of three classic frames with the same pose counter, or of
// one frame of CAN FD.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "vehicle/pose_guard.hpp"

namespace tessera {

/// A pose as it was sent, unchecked.
struct SentPose {
  Point3d p_map{0.0, 0.0, 0.0};
  double roll_rad = 0.0;  ///< Rotation about x, then about y by pitch, then about z by heading.
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
  double std_position_m = 0.0;
  double std_heading_rad = 0.0;
  double age_ms = 0.0;
};

/// T_map_body = Rz(heading) Ry(pitch) Rx(roll), and the position.
[[nodiscard]] Matrix34d to_transform(const SentPose& pose) noexcept;

/// The pose in a frame of CAN FD; empty iff the vehicle marks it as invalid or a signal is out of
/// its range. data: of POSE_FD.
[[nodiscard]] std::optional<SentPose> read_fd_pose(std::span<const std::uint8_t> data) noexcept;

/// Assembles the three frames of a pose. A frame with another counter value starts a new pose, so a
/// lost frame costs only its pose.
class PoseAssembly {
 public:
  enum class Part : std::uint8_t { kXy = 0, kZh = 1, kRp = 2 };
  /// Longest time from the first frame of a pose to its last.
  static constexpr std::int64_t kMaxSpreadUs = 15'000;

  struct Whole {
    SentPose pose{};
    std::int64_t first_received_us = 0;
    bool valid = false;  ///< False: the vehicle has none, or a signal is out of range.
  };
  /// data: of the part's message, checked to be undamaged. Returns a pose with its last frame.
  /// O(1).
  std::optional<Whole> take(Part part, std::span<const std::uint8_t> data,
                            std::int64_t received_us) noexcept;
  /// Poses that were dropped because one of their frames was missing or too late.
  [[nodiscard]] std::uint64_t incomplete() const noexcept { return incomplete_; }

 private:
  SentPose pose_{};
  bool in_range_ = true;
  unsigned parts_ = 0;  ///< A bit for each that has arrived.
  std::uint32_t counter_ = 0;
  std::int64_t first_received_us_ = 0;
  std::uint64_t incomplete_ = 0;
};

}  // namespace tessera
