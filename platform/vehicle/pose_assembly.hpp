// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A pose out of the bytes of the bus: of three classic frames that bear the same pose counter, or
// of one frame of CAN FD.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "vehicle/pose_guard.hpp"

namespace tessera {

/// A pose as it was sent, before anybody has looked whether it can be one.
struct SentPose {
  Point3d p_map{0.0, 0.0, 0.0};
  double roll_rad = 0.0;  ///< Turned about x, then about y by pitch, then about z by heading.
  double pitch_rad = 0.0;
  double heading_rad = 0.0;
  double std_position_m = 0.0;
  double std_heading_rad = 0.0;
  double age_ms = 0.0;
};

/// T_map_body = Rz(heading) Ry(pitch) Rx(roll), and the position.
[[nodiscard]] Matrix34d to_transform(const SentPose& pose) noexcept;

/// What the vehicle put into a frame of CAN FD; nothing iff it says that the pose is not valid or a
/// signal is out of its range. data: of POSE_FD.
[[nodiscard]] std::optional<SentPose> read_fd_pose(std::span<const std::uint8_t> data) noexcept;

/// Puts the three frames of a pose together. Frames of another counter value start anew, so a lost
/// frame costs its pose and no more.
class PoseAssembly {
 public:
  enum class Part : std::uint8_t { kXy = 0, kZh = 1, kRp = 2 };
  /// From the first frame of a pose to its last.
  static constexpr std::int64_t kMaxSpreadUs = 15'000;

  struct Whole {
    SentPose pose{};
    std::int64_t first_received_us = 0;
    bool valid = false;  ///< False: the vehicle says that it has none, or a signal is out of range.
  };
  /// data: of the part's message, checked to be undamaged. Gives a pose with its last frame. O(1).
  std::optional<Whole> take(Part part, std::span<const std::uint8_t> data,
                            std::int64_t received_us) noexcept;
  /// Poses that were given up because a frame of theirs did not come, or came too late.
  [[nodiscard]] std::uint64_t incomplete() const noexcept { return incomplete_; }

 private:
  SentPose pose_{};
  bool in_range_ = true;
  unsigned parts_ = 0;  ///< A bit for each that has come.
  std::uint32_t counter_ = 0;
  std::int64_t first_received_us_ = 0;
  std::uint64_t incomplete_ = 0;
};

}  // namespace tessera
