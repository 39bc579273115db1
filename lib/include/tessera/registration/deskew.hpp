// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Takes the robot's motion out of a sweep: a spinning scanner measures its points one after the
// other, and each is moved to where the sensor would have seen it at the scan's stamp. What stands
// still comes out whole; what moves by itself stays smeared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/counters.hpp"
#include "tessera/base/robot_body.hpp"
#include "tessera/registration/points_view.hpp"
#include "tessera/registration/pose_track.hpp"

namespace tessera {

/// How poses over a sweep are taken.
struct DeskewConfig {
  static constexpr int kMostKnots = 64;

  int knots = 32;                     ///< Poses over the sweep, 2 .. kMostKnots.
  double most_s = 0.5;                ///< Farthest that a point's time is from the stamp, 0 .. 10.
  std::int64_t max_gap_us = 150'000;  ///< Between poses, as PoseTrack::at; not negative.
  /// Points that cannot be placed become NaN, for the integrator to refuse; else they stay as they
  /// are.
  bool refuse_unplaced = false;
};

/// A sweep: its points in the sensor's frame at their own times.
struct Sweep {
  PointsView points;
  const float* times_s = nullptr;  ///< Of each point, seconds after the stamp; may be negative.
  std::int64_t stamp_us = 0;
  Matrix34d T_body_sensor = Matrix34d::Identity();
  /// Points on it move with the sensor and stay as they are, for the integrator to refuse.
  RobotBody body{};
  /// Of each point as ScanView::no_return, or null. Where it is not 0, x y z is a direction from
  /// the sensor, of any length: it is turned as the sensor turned, and not shifted.
  const std::uint8_t* no_return = nullptr;
};

/// Each point is in one of the last five.
#define TESSERA_DESKEW_COUNTERS(ROW)                                                       \
  ROW(LEVEL, int32_t, knots, "Poses looked up in the track.")                              \
  ROW(LEVEL, int32_t, knots_without_pose, "Of these, those that the track does not have.") \
  ROW(COUNTER, uint32_t, moved, "Points placed in the sensor's frame at the stamp.")       \
  ROW(COUNTER, uint32_t, non_finite, "Points that are not finite.")                        \
  ROW(COUNTER, uint32_t, bad_time,                                                         \
      "Points not placed: the time is NaN or over the limit from the stamp.")              \
  ROW(COUNTER, uint32_t, without_pose,                                                     \
      "Points not placed: the track has no pose for that part of the sweep.")              \
  ROW(COUNTER, uint32_t, on_body, "Points on the robot's own body, which are not moved.")

/// What was done.
struct DeskewReport {
  /// kOk; else nothing was written: kOutOfRange iff the track has no pose at the stamp;
  /// kInvalidArgument iff a configured number is out of its range, T_body_sensor is not rigid,
  /// body does not allow T_body_sensor, there are points but no times, a stride is under 3, the
  /// output is too small, or the stamp is within 20 s of the numbers' end.
  Status status = Status::kOk;
  TESSERA_DESKEW_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(DeskewReport, TESSERA_DESKEW_COUNTERS(TESSERA_COUNTER_ROW))

/// Writes x y z of point i, in the sensor's frame at the stamp, to out[i * points.stride_floats];
/// what follows in the stride is not touched. out may be the points' own memory. The poses are
/// interpolated at knots, evenly from the first time of a point to the last, and a point between
/// two of them is put on the straight line between the places that they give it: for a turn of a in
/// the time t between two knots, at an acceleration of b, that is off by up to
/// (range * a^2 + b t^2) / 8: 0.2 mm at 40 m and 2 rad/s over 0.1 s with 32 knots. The same bits on
/// every machine. O(points + knots log(track.size())).
DeskewReport deskew(const PoseTrack& track, const Sweep& sweep, const DeskewConfig& config,
                    std::span<float> out) noexcept;

}  // namespace tessera
