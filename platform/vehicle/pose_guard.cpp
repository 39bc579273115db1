// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/pose_guard.hpp"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

double distance_m(const Matrix34d& a, const Matrix34d& b) noexcept {
  return norm(Point3d(a.col(3) - b.col(3)));
}

bool is_deviation(double value) noexcept { return std::isfinite(value) && value >= 0.0; }

bool is_number(const std::optional<double>& value) noexcept {
  return value.has_value() && std::isfinite(*value);
}

}  // namespace

double turn_between(const Matrix34d& a, const Matrix34d& b) noexcept {
  double trace = 0.0;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) trace += a(row, column) * b(row, column);
  return std::acos(std::clamp((trace - 1.0) / 2.0, -1.0, 1.0));
}

void PoseGuard::moves(const VehicleMotion& motion) noexcept {
  add_up(motion.received_us);
  motion_ = motion;
}

bool PoseGuard::is_recent(std::int64_t now_us) const noexcept {
  return now_us - motion_.received_us <= config_.motion_timeout_us;
}

/// A motion report holds until the next one. A pose of three frames has the time of the first,
/// which may be before that of odometry between them.
void PoseGuard::add_up(std::int64_t now_us) noexcept {
  const std::int64_t step_us = now_us - said_.until_us;
  if (step_us <= 0) return;
  said_.until_us = now_us;
  if (!is_recent(now_us) || !is_number(motion_.speed_mps) || !is_number(motion_.yaw_rate_radps)) {
    said_.blind_us += step_us;
    return;
  }
  const double seconds = static_cast<double>(step_us) * 1e-6;
  said_.sum.way_m += std::abs(*motion_.speed_mps) * seconds;
  said_.sum.turn_rad += std::abs(*motion_.yaw_rate_radps) * seconds;
}

PoseVerdict PoseGuard::judge(const PoseObservation& observation) noexcept {
  add_up(observation.received_us);
  static_cast<void>(state(observation.received_us));
  const PoseVerdict found = inspect(observation);
  PoseVerdict verdict = found;
  if (found == PoseVerdict::kGood) {
    ++good_in_row_;
    const bool settled = state_ == PoseVerdict::kGood || good_in_row_ >= config_.recover_after;
    verdict = settled ? PoseVerdict::kGood : PoseVerdict::kRecovering;
    state_ = verdict;
    was_good_ = was_good_ || settled;
  } else if (found != PoseVerdict::kOutOfOrder) {
    fail(found);
  }
  ++counts_[static_cast<std::size_t>(verdict)];
  return verdict;
}

PoseVerdict PoseGuard::state(std::int64_t now_us) noexcept {
  if (has_pose_ && !silent_ && now_us - last_received_us_ > config_.timeout_us) {
    silent_ = true;
    ++timeouts_;
    fail(PoseVerdict::kStale);
    // Its motion meanwhile is not known: its velocity may be any.
    reference_.base = reference_.next_base = reference_.pose;
  }
  return state_;
}

void PoseGuard::forget() noexcept {
  fail(PoseVerdict::kNone);
  has_pose_ = silent_ = has_reference_ = frozen_ = false;
  window_ = {};
  candidate_in_row_ = 0;
  said_.until_us = 0;  // The clock may have changed.
}

void PoseGuard::fail(PoseVerdict verdict) noexcept {
  state_ = verdict;
  good_in_row_ = 0;
}

/// In this order: later checks rely on earlier ones.
PoseVerdict PoseGuard::inspect(const PoseObservation& observation) noexcept {
  const StampedPose& pose = observation.pose;
  const bool numbers = check_rigid(pose.T_map_body) == Status::kOk &&
                       is_deviation(observation.std_position_m) &&
                       is_deviation(observation.std_heading_rad);
  if (!numbers || pose.T_map_body.col(3).cwiseAbs().maxCoeff() > config_.max_coordinate_m)
    return PoseVerdict::kCorrupt;
  if (pose.stamp_us > observation.received_us + config_.max_ahead_us) return PoseVerdict::kCorrupt;
  if (has_pose_ && pose.stamp_us <= last_stamp_us_) return PoseVerdict::kOutOfOrder;
  if (pose.stamp_us < observation.received_us - config_.max_age_us) return PoseVerdict::kStale;
  const bool was_silent = silent_;
  has_pose_ = true;
  silent_ = false;
  last_stamp_us_ = pose.stamp_us;
  last_received_us_ = observation.received_us;
  if (observation.std_position_m > config_.max_std_position_m ||
      observation.std_heading_rad > config_.max_std_heading_rad)
    return PoseVerdict::kUncertain;
  if (has_reference_ && stops_dead(observation)) return PoseVerdict::kFrozen;
  if (has_reference_ && jumps(observation)) return PoseVerdict::kJumping;
  candidate_in_row_ = 0;
  const Reach said = said_since_reference(observation);
  const bool held = has_reference_ && is_held(pose, said);
  const bool frozen = is_frozen(pose, said);
  // A way during a silence, or to catch up with the wheels, does not give the velocity.
  const bool on_course =
      has_reference_ && !was_silent && course_strain(reference_, observation) <= 1.0;
  reference_ = on_course ? follow(reference_, observation) : begin(observation);
  has_reference_ = true;
  if (!held) moved_ = reference_;
  return frozen ? PoseVerdict::kFrozen : PoseVerdict::kGood;
}

/// The length of a step as a share of the farthest plausible one: reach, or what the vehicle can do
/// in that time if that is less.
double PoseGuard::share(const Reference& from, const PoseObservation& to,
                        const Reach& reach) const noexcept {
  const double seconds = static_cast<double>(to.pose.stamp_us - from.pose.stamp_us) * 1e-6;
  const double far_m = std::min(reach.way_m, config_.max_speed_mps * seconds) + config_.slack_m +
                       config_.sigmas * std::hypot(from.std_position_m, to.std_position_m);
  const double far_rad = std::min(reach.turn_rad, config_.max_yaw_rate_radps * seconds) +
                         config_.slack_rad +
                         config_.sigmas * std::hypot(from.std_heading_rad, to.std_heading_rad);
  const Matrix34d& before = from.pose.T_map_body;
  const Matrix34d& after = to.pose.T_map_body;
  return std::max(distance_m(before, after) / far_m, turn_between(before, after) / far_rad);
}

/// A bit more than the motion that the vehicle reported since then.
PoseGuard::Reach PoseGuard::said_since(const Reference& from) const noexcept {
  return {config_.wheels_factor * (said_.sum.way_m - from.said.sum.way_m),
          config_.wheels_factor * (said_.sum.turn_rad - from.said.sum.turn_rad)};
}

/// A pose beyond a jump stays implausible, even when enough time for the way has passed.
bool PoseGuard::jumps(const PoseObservation& observation) noexcept {
  const bool was_held = moved_.pose.stamp_us < reference_.pose.stamp_us;
  const double lag = was_held ? lag_strain(observation) : 2.0;
  const double here = std::min(strain(reference_, observation), lag);
  const double there = candidate_in_row_ > 0 ? strain(candidate_, observation) : 2.0;
  const bool is_here = there > 1.0 || lag <= there || is_nearer_here(observation, here, there);
  if (here <= 1.0 && is_here) return false;
  return !is_relocated(observation, there <= 1.0);
}

/// Poses beyond a jump are accepted once enough of them agree with each other.
bool PoseGuard::is_relocated(const PoseObservation& observation, bool agrees) noexcept {
  candidate_in_row_ = agrees ? candidate_in_row_ + 1 : 1;
  candidate_ = follow(agrees ? candidate_ : begin(observation), observation);
  if (candidate_in_row_ < config_.relocate_after) return false;
  reference_ = candidate_;
  // If nothing was mapped in a frame, leaving it does not matter.
  relocations_ += was_good_ ? 1U : 0U;
  window_ = {};
  frozen_ = false;
  return true;
}

/// Backwards and to the right are negative.
PoseGuard::Reach PoseGuard::said_since_reference(
    const PoseObservation& observation) const noexcept {
  if (!is_recent(observation.received_us)) return {};
  // Time without poses proves nothing: the motion meanwhile is not known.
  const std::int64_t step_us =
      std::min(observation.pose.stamp_us - reference_.pose.stamp_us, config_.timeout_us);
  const double seconds = static_cast<double>(step_us) * 1e-6;
  double speed_mps = motion_.state == MotionState::kMoving ? config_.moving_speed_mps : 0.0;
  if (is_number(motion_.speed_mps)) speed_mps = *motion_.speed_mps;
  const bool turns = is_number(motion_.yaw_rate_radps) &&
                     std::abs(*motion_.yaw_rate_radps) >= config_.min_yaw_rate_radps;
  return {speed_mps * seconds, turns ? *motion_.yaw_rate_radps * seconds : 0.0};
}

/// True if the pose stays the same while the vehicle moves. A radian counts as a metre, so that
/// noise in one of them does not hide that the other stays.
bool PoseGuard::is_held(const StampedPose& pose, const Reach& said) const noexcept {
  const Matrix34d& before = reference_.pose.T_map_body;
  const double went = distance_m(before, pose.T_map_body) + turn_between(before, pose.T_map_body);
  return went < config_.frozen_share * (std::abs(said.way_m) + std::abs(said.turn_rad));
}

bool PoseGuard::is_frozen(const StampedPose& pose, const Reach& said) noexcept {
  // For a way forward and back no motion of the pose can be demanded.
  if (!window_.open || window_.said.way_m * said.way_m < 0.0) {
    window_ = {.start = pose, .said = {}, .open = true};
    return frozen_;
  }
  window_.said.way_m += said.way_m;
  window_.said.turn_rad += said.turn_rad;
  const double said_m = std::abs(window_.said.way_m);
  const double said_rad = std::abs(window_.said.turn_rad);
  const double went_m = distance_m(window_.start.T_map_body, pose.T_map_body);
  const double turned_rad = turn_between(window_.start.T_map_body, pose.T_map_body);
  const bool goes = went_m >= config_.frozen_share * said_m;
  const bool turns = turned_rad >= config_.frozen_share * said_rad;
  // A frozen pose only needs to move to be valid again.
  if (frozen_ && goes && turns &&
      (went_m >= config_.frozen_share * config_.frozen_travel_m ||
       turned_rad >= config_.frozen_share * config_.frozen_turn_rad)) {
    frozen_ = false;
    window_ = {.start = pose, .said = {}, .open = true};
    return false;
  }
  const bool far = said_m >= config_.frozen_travel_m;
  const bool wide = said_rad >= config_.frozen_turn_rad;
  if (pose.stamp_us - window_.start.stamp_us < config_.frozen_us || (!far && !wide)) return frozen_;
  frozen_ = (far && !goes) || (wide && !turns);
  window_ = {.start = pose, .said = {}, .open = true};
  return frozen_;
}

}  // namespace tessera
