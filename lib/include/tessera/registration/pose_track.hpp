// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the robot was: its latest poses, and the pose in between by interpolation. For taking the
// motion out of a scan, and for sensors that measure at another time than the scanner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

/// Where the body was, and when.
struct StampedPose {
  std::int64_t stamp_us = 0;
  Matrix34d T_map_body = Matrix34d::Identity();
};

/// What a track took and refused since it was made; clear() leaves it as it is.
struct PoseTrackReport {
  std::uint64_t added = 0;
  std::uint64_t overwritten = 0;  ///< Of these, those that a full track has forgotten again.
  std::uint64_t refused_not_rigid = 0;
  std::uint64_t refused_not_later = 0;
};

/// A ring of the latest poses, in rising order of their stamps. Not for several threads at once.
class PoseTrack {
 public:
  static constexpr std::size_t kMostPoses = std::size_t{1} << 20U;

  /// For the arena; capacity: 1 .. kMostPoses.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::size_t capacity) noexcept {
    return arena_bytes<StampedPose>(capacity);
  }
  /// Fails with kInvalidArgument iff the capacity is not 1 .. kMostPoses, with kResourceExhausted
  /// iff the arena has no room for it. O(capacity).
  [[nodiscard]] static Result<PoseTrack> make(std::size_t capacity, Arena& arena) noexcept;
  PoseTrack() noexcept = default;  ///< Takes no pose and has none.

  /// Adds a pose; a full track forgets its oldest. Fails, counted and with nothing changed, with
  /// kInvalidArgument iff the pose is not rigid (check_rigid), with kMismatch iff its stamp is not
  /// later than the latest, with kResourceExhausted iff the track was not made. After a step back
  /// of the clock every pose is too early: call clear() then. O(1).
  Status add(const StampedPose& pose) noexcept;
  /// Forgets all poses.
  void clear() noexcept { size_ = 0; }

  /// T_map_body at a time. At a stamp the pose as it was added; between two, interpolate() of
  /// both. Fails with kOutOfRange iff the time is before the oldest or after the latest pose
  /// (nothing is extrapolated), or between two that are more than max_gap_us apart.
  /// O(log size).
  [[nodiscard]] Result<Matrix34d> at(std::int64_t stamp_us, std::int64_t max_gap_us) const noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return ring_.size(); }
  /// Pose i of size(), the oldest first.
  [[nodiscard]] const StampedPose& operator[](std::size_t i) const noexcept {
    TESSERA_ASSERT(i < size_);
    const std::size_t place = first_ + i;
    return ring_[place < ring_.size() ? place : place - ring_.size()];
  }
  /// Stamps of the ends; 0 without poses.
  [[nodiscard]] std::int64_t oldest_us() const noexcept {
    return size_ == 0 ? 0 : (*this)[0].stamp_us;
  }
  [[nodiscard]] std::int64_t latest_us() const noexcept {
    return size_ == 0 ? 0 : (*this)[size_ - 1].stamp_us;
  }
  [[nodiscard]] const PoseTrackReport& report() const noexcept { return report_; }

 private:
  std::span<StampedPose> ring_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  PoseTrackReport report_;
};

}  // namespace tessera
