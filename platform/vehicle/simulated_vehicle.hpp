// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A vehicle that drives along given poses and sends them on its bus, as a controller does, cycle by
// cycle. No clock, no heap; the caller has both.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/registration/pose_track.hpp"
#include "vehicle/vehicle_frames.hpp"

namespace tessera {

struct SimulatedVehicleConfig {
  std::uint32_t base_id = kDefaultBaseId;  ///< See is_base_id().
  std::int64_t max_gap_us = 250'000;       ///< Between poses, as PoseTrack::at.
  double std_position_m = 0.02;            ///< Deviations that are sent with poses.
  double std_heading_rad = 0.003;
};

class SimulatedVehicle {
 public:
  /// Cycle of poses and odometry.
  static constexpr std::int64_t kCycle_us = 20'000;
  /// The vehicle's state and its command, which is none, are sent once in this many cycles.
  static constexpr int kSlowCycles = 5;
  static constexpr std::size_t kMostFrames = 6;

  explicit SimulatedVehicle(const SimulatedVehicleConfig& config = {}) noexcept
      : config_(config), frames_(config.base_id) {}

  /// The frames of a cycle, in the order to send them, valid until the next call: pose, odometry
  /// since the cycle before, and every kSlowCycles state and command. at_us: time on the track;
  /// age_us: its age. If the track has no pose (PoseTrack::at), no pose is sent and odometry is not
  /// valid, as in the first cycle. O(log track.size()).
  std::span<const CanFrame> cycle(const PoseTrack& track, std::int64_t at_us,
                                  std::int64_t age_us) noexcept;
  [[nodiscard]] std::uint64_t poses() const noexcept { return poses_; }

 private:
  [[nodiscard]] WheelMotion since_before(const StampedPose& now) const noexcept;

  SimulatedVehicleConfig config_;
  VehicleFrames frames_;
  std::array<CanFrame, kMostFrames> out_{};
  StampedPose before_{};
  bool has_before_ = false;
  int cycles_ = 0;  ///< Cycles until state and command are due.
  std::uint64_t poses_ = 0;
};

}  // namespace tessera
