// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Predicts a vehicle's pose, and measures how far another pose is from that.
#include <algorithm>
#include <cmath>

#include "vehicle/pose_guard.hpp"

namespace tessera {
namespace {

/// Distance from the prediction by a velocity from one pose for the time until another.
double off_course_m(const StampedPose& from, const Point3d& velocity_mps,
                    const StampedPose& to) noexcept {
  const double seconds = static_cast<double>(to.stamp_us - from.stamp_us) * 1e-6;
  return norm(Point3d(to.T_map_body.col(3) - from.T_map_body.col(3) - seconds * velocity_mps));
}

}  // namespace

PoseGuard::Reference PoseGuard::begin(const PoseObservation& at) const noexcept {
  return {.pose = at.pose,
          .std_position_m = at.std_position_m,
          .std_heading_rad = at.std_heading_rad,
          .said = said_,
          .base = at.pose,
          .next_base = at.pose};
}

/// The base is one to two times velocity_us old if poses are frequent, else the pose before.
PoseGuard::Reference PoseGuard::follow(const Reference& before,
                                       const PoseObservation& to) const noexcept {
  Reference reference = begin(to);
  reference.base = before.base;
  reference.next_base = before.next_base;
  if (to.pose.stamp_us - before.next_base.stamp_us >= config_.velocity_us) {
    reference.base = before.next_base;
    reference.next_base = to.pose;
  }
  return reference;
}

PoseGuard::Course PoseGuard::course_of(const Reference& from) const noexcept {
  const std::int64_t baseline_us = from.pose.stamp_us - from.base.stamp_us;
  if (baseline_us < config_.velocity_us) return {};
  const double baseline_s = static_cast<double>(baseline_us) * 1e-6;
  const Point3d way = from.pose.T_map_body.col(3) - from.base.T_map_body.col(3);
  return {way / baseline_s, baseline_s};
}

/// Distance of a pose from the reference's prediction, as a share of the farthest plausible one.
/// The mean velocities of two successive spans of time differ at most by the acceleration times
/// half of both. 0 if the reference has no velocity yet.
double PoseGuard::course_strain(const Reference& from, const PoseObservation& to) const noexcept {
  const Course course = course_of(from);
  if (course.baseline_s <= 0.0) return 0.0;
  const double seconds = static_cast<double>(to.pose.stamp_us - from.pose.stamp_us) * 1e-6;
  const double far_m =
      0.5 * config_.max_acceleration_mps2 * seconds * (course.baseline_s + seconds) +
      config_.slack_m + config_.sigmas * std::hypot(from.std_position_m, to.std_position_m);
  return off_course_m(from.pose, course.velocity_mps, to.pose) / far_m;
}

/// Time alone does not make another frame plausible: after a silence the motion reported by the
/// vehicle counts, and without reports at most max_blind_us.
double PoseGuard::strain(const Reference& from, const PoseObservation& to) const noexcept {
  const std::int64_t blind_us = std::min(said_.blind_us - from.said.blind_us, config_.max_blind_us);
  const double seconds = static_cast<double>(std::max(blind_us, config_.timeout_us)) * 1e-6;
  const Reach said = said_since(from);
  const Reach reach{said.way_m + config_.max_speed_mps * seconds,
                    said.turn_rad + config_.max_yaw_rate_radps * seconds};
  return std::max(share(from, to, reach), course_strain(from, to));
}

/// The same from the last pose that moved: a pose that was held and catches up with the vehicle has
/// not left its frame. Only reported motion counts here, otherwise standing would allow any step.
double PoseGuard::lag_strain(const PoseObservation& to) const noexcept {
  return share(moved_, to, said_since(moved_));
}

/// True if the pose stops faster than any brake allows: the source repeats its last pose. Such a
/// pose is not another frame, however often it comes.
bool PoseGuard::stops_dead(const PoseObservation& to) const noexcept {
  return course_strain(reference_, to) > 1.0 && share(reference_, to, {}) <= 1.0;
}

/// Assigns a pose to the reference or to the poses beyond a jump. The plausible distance grows with
/// the time since the reference, nearness does not. A left frame continues at its velocity.
bool PoseGuard::is_nearer_here(const PoseObservation& to, double here,
                               double there) const noexcept {
  const Course course = course_of(reference_);
  if (course.baseline_s <= 0.0) return here <= there;
  const Course beyond = course_of(candidate_);
  const Point3d& velocity_mps = beyond.baseline_s > 0.0 ? beyond.velocity_mps : course.velocity_mps;
  return off_course_m(reference_.pose, course.velocity_mps, to.pose) <=
         off_course_m(candidate_.pose, velocity_mps, to.pose);
}

}  // namespace tessera
