// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/registration/deskew.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

constexpr double kMicroseconds = 1e6;
/// Stamps farther from 0 have no room for the times of a sweep.
constexpr std::int64_t kMostStamp_us = std::numeric_limits<std::int64_t>::max() - 20'000'000;

/// The times of a sweep that can be used, in microseconds after its stamp.
struct TimeRange {
  bool empty = true;
  double first_us = 0.0;
  double last_us = 0.0;
};

/// Written so that NaN fails.
bool in_sweep(double time_us, const DeskewConfig& config) noexcept {
  return std::abs(time_us) <= config.most_s * kMicroseconds;
}

TimeRange range_of(const Sweep& sweep, const DeskewConfig& config) noexcept {
  TimeRange range;
  for (std::size_t i = 0; i < sweep.points.count; ++i) {
    const double time_us = static_cast<double>(sweep.times_s[i]) * kMicroseconds;
    if (!in_sweep(time_us, config)) continue;
    if (range.empty || time_us < range.first_us) range.first_us = time_us;
    if (range.empty || time_us > range.last_us) range.last_us = time_us;
    range.empty = false;
  }
  return range;
}

/// Poses of the sensor at even times, seen from the sensor at the stamp.
class Knots {
 public:
  Knots(const PoseTrack& track, const Sweep& sweep, const DeskewConfig& config,
        const Matrix34d& T_stamp_map, const TimeRange& range, DeskewReport& report) noexcept
      : first_us_(rounded(range.first_us)) {
    const std::int64_t last_us = rounded(range.last_us);
    // Whole microseconds, so that knots are at the stamps that the track is asked for.
    step_us_ = (last_us - first_us_) / (config.knots - 1) + 1;
    count_ = static_cast<int>((last_us - first_us_) / step_us_) + 2;
    if (count_ > config.knots) count_ = config.knots;
    for (int i = 0; i < count_; ++i) {
      std::int64_t time_us = first_us_ + i * step_us_;
      // The last may be beyond the sweep, where there is perhaps no pose yet.
      if (time_us > last_us) time_us = last_us;
      const std::size_t k = static_cast<std::size_t>(i);
      times_us_[k] = static_cast<double>(time_us);
      const Result<Matrix34d> T_map_body = track.at(sweep.stamp_us + time_us, config.max_gap_us);
      known_[k] = T_map_body.ok();
      ++report.knots;
      report.knots_without_pose += known_[k] ? 0 : 1;
      if (known_[k])
        poses_stamp_[k] = product(T_stamp_map, product(*T_map_body, sweep.T_body_sensor));
    }
  }

  /// Sets p_stamp to the place, seen from the stamp, of what was at p_sensor at a time of the
  /// range, or to the direction there of what was in that direction; false iff there is no pose
  /// around it.
  [[nodiscard]] bool place(const Point3d& p_sensor, double time_us, bool is_direction,
                           Point3d& p_stamp) const noexcept {
    int i = static_cast<int>((time_us - static_cast<double>(first_us_)) /
                             static_cast<double>(step_us_));
    if (i > count_ - 2) i = count_ - 2;  // The first and the last time may be rounded inwards.
    const auto k = static_cast<std::size_t>(i);
    const double span_us = times_us_[k + 1] - times_us_[k];
    const double share =
        span_us > 0.0 ? std::clamp((time_us - times_us_[k]) / span_us, 0.0, 1.0) : 0.0;
    const bool needs_next = share > 0.0;
    if (!known_[k] || (needs_next && !known_[k + 1])) return false;
    p_stamp = apply(poses_stamp_[k], p_sensor);
    if (is_direction) p_stamp -= poses_stamp_[k].col(3);
    if (!needs_next) return true;
    Point3d next = apply(poses_stamp_[k + 1], p_sensor);
    if (is_direction) next -= poses_stamp_[k + 1].col(3);
    for (int axis = 0; axis < 3; ++axis) p_stamp[axis] += share * (next[axis] - p_stamp[axis]);
    return true;
  }

 private:
  /// Moved to where it is positive, so that cutting off the fraction is rounding down: no libm.
  static std::int64_t rounded(double time_us) noexcept {
    constexpr std::int64_t kAbove_us = 20'000'000;
    const double moved_us = time_us + (static_cast<double>(kAbove_us) + 0.5);
    return static_cast<std::int64_t>(moved_us) - kAbove_us;
  }

  std::int64_t first_us_;
  std::int64_t step_us_ = 1;
  int count_ = 0;
  std::array<bool, DeskewConfig::kMostKnots> known_{};
  std::array<double, DeskewConfig::kMostKnots> times_us_{};
  std::array<Matrix34d, DeskewConfig::kMostKnots> poses_stamp_;  ///< T_stamp_knot.
};

bool valid(const Sweep& sweep, const DeskewConfig& config, std::span<float> out) noexcept {
  const PointsView& points = sweep.points;
  return config.knots >= 2 && config.knots <= DeskewConfig::kMostKnots && config.most_s >= 0.0 &&
         config.most_s <= 10.0 && config.max_gap_us >= 0 && sweep.stamp_us <= kMostStamp_us &&
         sweep.stamp_us >= -kMostStamp_us && points.stride_floats >= 3 &&
         check_rigid(sweep.T_body_sensor) == Status::kOk && sweep.body.is_valid() &&
         sweep.body.allows(sweep.T_body_sensor) &&
         (points.count == 0 || sweep.times_s != nullptr) &&
         out.size() / points.stride_floats >= points.count;
}

enum class PointResult : std::uint8_t { kMoved, kNonFinite, kBadTime, kWithoutPose, kOnBody };

PointResult move_point(const Sweep& sweep, const BodyView& body, const DeskewConfig& config,
                       const Knots& knots, std::size_t i, Point3d& p_stamp) noexcept {
  const float* const p = sweep.points.points + i * sweep.points.stride_floats;
  p_stamp = {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  const double square_m2 = squared_norm(p_stamp);
  if (!(square_m2 < 1e300)) return PointResult::kNonFinite;
  const bool is_direction = sweep.no_return != nullptr && sweep.no_return[i] != 0;
  if (!is_direction && body.holds(p_stamp, square_m2)) return PointResult::kOnBody;
  const double time_us = static_cast<double>(sweep.times_s[i]) * kMicroseconds;
  if (!in_sweep(time_us, config)) return PointResult::kBadTime;
  const Point3d p_sensor = p_stamp;
  return knots.place(p_sensor, time_us, is_direction, p_stamp) ? PointResult::kMoved
                                                               : PointResult::kWithoutPose;
}

}  // namespace

DeskewReport deskew(const PoseTrack& track, const Sweep& sweep, const DeskewConfig& config,
                    std::span<float> out) noexcept {
  DeskewReport report;
  if (!valid(sweep, config, out)) {
    report.status = Status::kInvalidArgument;
    return report;
  }
  const Result<Matrix34d> T_map_body = track.at(sweep.stamp_us, config.max_gap_us);
  if (!T_map_body.ok()) {
    report.status = T_map_body.status();
    return report;
  }
  const Matrix34d T_stamp_map = inverse(product(*T_map_body, sweep.T_body_sensor));
  const Knots knots(track, sweep, config, T_stamp_map, range_of(sweep, config), report);
  const BodyView body(sweep.body, sweep.T_body_sensor);
  for (std::size_t i = 0; i < sweep.points.count; ++i) {
    Point3d p_stamp;
    const PointResult result = move_point(sweep, body, config, knots, i, p_stamp);
    report.moved += result == PointResult::kMoved ? 1U : 0U;
    report.non_finite += result == PointResult::kNonFinite ? 1U : 0U;
    report.bad_time += result == PointResult::kBadTime ? 1U : 0U;
    report.without_pose += result == PointResult::kWithoutPose ? 1U : 0U;
    report.on_body += result == PointResult::kOnBody ? 1U : 0U;
    const bool refused =
        config.refuse_unplaced && result != PointResult::kMoved && result != PointResult::kOnBody;
    for (int axis = 0; axis < 3; ++axis) {
      out[i * sweep.points.stride_floats + static_cast<std::size_t>(axis)] =
          refused ? std::numeric_limits<float>::quiet_NaN() : round_to_float(p_stamp[axis]);
    }
  }
  return report;
}

}  // namespace tessera
