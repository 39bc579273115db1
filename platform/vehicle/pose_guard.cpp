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

}  // namespace

double turn_between(const Matrix34d& a, const Matrix34d& b) noexcept {
  double trace = 0.0;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) trace += a(row, column) * b(row, column);
  return std::acos(std::clamp((trace - 1.0) / 2.0, -1.0, 1.0));
}

PoseVerdict PoseGuard::judge(const PoseObservation& observation) noexcept {
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
  }
  return state_;
}

void PoseGuard::forget() noexcept {
  fail(PoseVerdict::kNone);
  has_pose_ = silent_ = has_reference_ = frozen_ = false;
  window_ = {};
  candidate_in_row_ = 0;
}

void PoseGuard::fail(PoseVerdict verdict) noexcept {
  state_ = verdict;
  good_in_row_ = 0;
}

/// In this order: what comes later relies on what was checked before.
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
  has_pose_ = true;
  silent_ = false;
  last_stamp_us_ = pose.stamp_us;
  last_received_us_ = observation.received_us;
  if (observation.std_position_m > config_.max_std_position_m ||
      observation.std_heading_rad > config_.max_std_heading_rad)
    return PoseVerdict::kUncertain;
  if (has_reference_ && jumps(observation)) return PoseVerdict::kJumping;
  candidate_in_row_ = 0;
  const bool frozen = is_frozen(observation);
  reference_ = {pose, observation.std_position_m, observation.std_heading_rad};
  has_reference_ = true;
  return frozen ? PoseVerdict::kFrozen : PoseVerdict::kGood;
}

/// How far a step goes, as a share of the farthest that is plausible.
double PoseGuard::strain(const Reference& from, const PoseObservation& to) const noexcept {
  const double seconds = static_cast<double>(to.pose.stamp_us - from.pose.stamp_us) * 1e-6;
  const double far_m = config_.max_speed_mps * seconds + config_.slack_m +
                       config_.sigmas * std::hypot(from.std_position_m, to.std_position_m);
  const double far_rad = config_.max_yaw_rate_radps * seconds + config_.slack_rad +
                         config_.sigmas * std::hypot(from.std_heading_rad, to.std_heading_rad);
  const Matrix34d& before = from.pose.T_map_body;
  const Matrix34d& after = to.pose.T_map_body;
  return std::max(distance_m(before, after) / far_m, turn_between(before, after) / far_rad);
}

/// What a jump led to stays beyond it, though time makes the way there plausible: a pose belongs to
/// where it strains less.
bool PoseGuard::jumps(const PoseObservation& observation) noexcept {
  const double here = strain(reference_, observation);
  const double there = candidate_in_row_ > 0 ? strain(candidate_, observation) : 2.0;
  if (here <= 1.0 && here <= there) return false;
  return !is_relocated(observation, there <= 1.0);
}

/// Poses beyond a jump are believed once so many of them agree with each other.
bool PoseGuard::is_relocated(const PoseObservation& observation, bool agrees) noexcept {
  candidate_in_row_ = agrees ? candidate_in_row_ + 1 : 1;
  candidate_ = {observation.pose, observation.std_position_m, observation.std_heading_rad};
  if (candidate_in_row_ < config_.relocate_after) return false;
  // A frame that nothing was mapped in is none that was left.
  relocations_ += was_good_ ? 1U : 0U;
  window_ = {};
  frozen_ = false;
  return true;
}

double PoseGuard::said_speed_mps(std::int64_t now_us) const noexcept {
  if (now_us - motion_.received_us > config_.motion_timeout_us) return 0.0;
  if (motion_.speed_mps.has_value() && std::isfinite(*motion_.speed_mps))
    return std::abs(*motion_.speed_mps);
  return motion_.state == MotionState::kMoving ? config_.moving_speed_mps : 0.0;
}

bool PoseGuard::is_frozen(const PoseObservation& observation) noexcept {
  const StampedPose& pose = observation.pose;
  if (!window_.open) {
    window_ = {.start = pose, .travel_m = 0.0, .open = true};
    return frozen_;
  }
  // Time without poses proves nothing: what the vehicle did meanwhile is not known.
  const std::int64_t step_us =
      std::min(pose.stamp_us - reference_.pose.stamp_us, config_.timeout_us);
  window_.travel_m += said_speed_mps(observation.received_us) * static_cast<double>(step_us) * 1e-6;
  const double went_m = distance_m(window_.start.T_map_body, pose.T_map_body);
  // While it is frozen, the pose need only move to be alive again.
  if (frozen_ && went_m >= config_.frozen_share * config_.frozen_travel_m &&
      went_m >= config_.frozen_share * window_.travel_m) {
    frozen_ = false;
    window_ = {.start = pose, .travel_m = 0.0, .open = true};
    return false;
  }
  if (pose.stamp_us - window_.start.stamp_us < config_.frozen_us ||
      window_.travel_m < config_.frozen_travel_m)
    return frozen_;
  frozen_ = went_m < config_.frozen_share * window_.travel_m;
  window_ = {.start = pose, .travel_m = 0.0, .open = true};
  return frozen_;
}

}  // namespace tessera
