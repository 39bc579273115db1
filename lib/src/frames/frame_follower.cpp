// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/frame_follower.hpp"

#include "tessera/base/internal/quaternion.hpp"

namespace tessera {

namespace {

/// What a step takes of its limits, for rounding.
constexpr double kOfLimits = 1.0 - 1e-9;

/// 2 sin(a / 2) for the angle a between two rotations: twice the length of the vector part of
/// conj(one) other, which is exact for small angles, too.
double chord_between(const Matrix34d& T_one, const Matrix34d& T_other) noexcept {
  const Quaternion p = rotation_of(T_one);
  const Quaternion q = rotation_of(T_other);
  const double x = p[0] * q[1] - q[0] * p[1] - (p[2] * q[3] - p[3] * q[2]);
  const double y = p[0] * q[2] - q[0] * p[2] - (p[3] * q[1] - p[1] * q[3]);
  const double z = p[0] * q[3] - q[0] * p[3] - (p[1] * q[2] - p[2] * q[1]);
  return 2.0 * std::sqrt(squared_norm(x, y, z));
}

/// The same to the bit, as far as numbers are compared.
bool same_transform(const Matrix34d& one, const Matrix34d& other) noexcept {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      if (!(one(row, column) == other(row, column))) return false;
    }
  }
  return true;
}

}  // namespace

Status FrameFollower::follow(const Matrix34d& T_team_map) noexcept {
  if (!in_use_) return use_at_once(T_team_map);
  if (check_rigid(T_team_map) != Status::kOk) return Status::kInvalidArgument;
  target_ = T_team_map;
  arrived_ = same_transform(T_team_map_, target_);
  return Status::kOk;
}

Status FrameFollower::use_at_once(const Matrix34d& T_team_map) noexcept {
  if (check_rigid(T_team_map) != Status::kOk) return Status::kInvalidArgument;
  target_ = T_team_map;
  T_team_map_ = T_team_map;
  in_use_ = true;
  arrived_ = true;
  return Status::kOk;
}

bool FrameFollower::step(const Point3d& p_map, Instant now) noexcept {
  if (!in_use_ || arrived_ || now - last_step_ < kLeastPause) return false;
  TESSERA_ASSERT(p_map.allFinite());
  last_step_ = now;
  const Point3d p_from = apply(T_team_map_, p_map);
  const Point3d p_to = apply(target_, p_map);
  const Point3d way(p_to.x() - p_from.x(), p_to.y() - p_from.y(), p_to.z() - p_from.z());
  const double way_m = norm(way);
  const double chord = chord_between(T_team_map_, target_);
  const double way_rad = chord * (1.0 + chord * chord / 7.0);
  double share = 1.0;
  if (way_m > kMostStep_m * kOfLimits) share = kMostStep_m * kOfLimits / way_m;
  if (way_rad * share > kMostStep_rad * kOfLimits) share = kMostStep_rad * kOfLimits / way_rad;
  if (share >= 1.0) {
    T_team_map_ = target_;
    arrived_ = true;
    return true;
  }
  Matrix34d T = interpolate(T_team_map_, target_, share);
  for (int row = 0; row < 3; ++row) T(row, 3) = 0.0;
  const Point3d turned = apply(T, p_map);
  for (int row = 0; row < 3; ++row) T(row, 3) = p_from(row) + share * way(row) - turned(row);
  T_team_map_ = T;
  return true;
}

}  // namespace tessera
