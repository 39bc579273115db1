// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Bodies of robots, as boxes: returns in them are of a robot, and not of what is mapped.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "tessera/base/geometry.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

/// Corners in the body's frame, metres; the faces belong to it. The body's frame is the one of
/// T_body_sensor; where that is not given, the sensor's.
struct BodyBox {
  std::array<float, 3> low{};
  std::array<float, 3> high{};

  /// The point is in it, in its frame. NaN is not.
  [[nodiscard]] bool holds(const Point3d& p_body) const noexcept {
    bool inside = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const double at = p_body[static_cast<Eigen::Index>(i)];
      inside = inside && at >= static_cast<double>(low[i]) && at <= static_cast<double>(high[i]);
    }
    return inside;
  }
  /// How many lengths of the direction from a point, both finite and in its frame, the ray first
  /// meets it: 0 from within; infinity: never.
  [[nodiscard]] double met_after(const Point3d& from_body,
                                 const Point3d& direction) const noexcept {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    double enters = 0.0;
    double leaves = kNever;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      const double to_low = static_cast<double>(low[i]) - from_body[axis];
      const double to_high = static_cast<double>(high[i]) - from_body[axis];
      const double d = direction[axis];
      if (d == 0.0) {
        if (to_low > 0.0 || to_high < 0.0) return kNever;
        continue;
      }
      enters = std::max(enters, (d > 0.0 ? to_low : to_high) / d);
      leaves = std::min(leaves, (d > 0.0 ? to_high : to_low) / d);
    }
    if (!(enters <= leaves)) return kNever;
    return enters;
  }
  friend constexpr bool operator==(const BodyBox&, const BodyBox&) = default;
};

struct RobotBody {
  static constexpr std::size_t kMostBoxes = 8;
  static constexpr float kFarthest_m = 100.0F;  ///< Of a corner from 0, on each axis.

  std::array<BodyBox, kMostBoxes> boxes{};
  std::uint32_t count = 0;  ///< Of the boxes, those that are used.

  [[nodiscard]] constexpr std::span<const BodyBox> used() const noexcept {
    return std::span(boxes).first(count);
  }
  /// There are at most kMostBoxes, and of each low < high within kFarthest_m of 0. NaN fails.
  [[nodiscard]] constexpr bool is_valid() const noexcept {
    if (count > kMostBoxes) return false;
    for (const BodyBox& box : used()) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (!(box.low[i] >= -kFarthest_m && box.low[i] < box.high[i] && box.high[i] <= kFarthest_m))
          return false;
      }
    }
    return true;
  }
  /// A box has the point, in the body's frame. NaN is in none. O(boxes).
  [[nodiscard]] bool holds(const Point3d& p_body) const noexcept {
    return std::any_of(used().begin(), used().end(),
                       [&](const BodyBox& box) { return box.holds(p_body); });
  }
  /// The ray from a point outside along a direction, both finite, meets a box, however far.
  /// O(boxes).
  [[nodiscard]] bool is_met_by(const Point3d& from_body, const Point3d& direction) const noexcept {
    return std::any_of(used().begin(), used().end(), [&](const BodyBox& box) {
      return box.met_after(from_body, direction) < std::numeric_limits<double>::infinity();
    });
  }
  /// The smallest box that has all of them; nothing without any.
  [[nodiscard]] std::optional<BodyBox> hull() const noexcept {
    if (count == 0) return std::nullopt;
    BodyBox hull = boxes.front();
    for (const BodyBox& box : used()) {
      for (std::size_t i = 0; i < 3; ++i) {
        hull.low[i] = std::min(hull.low[i], box.low[i]);
        hull.high[i] = std::max(hull.high[i], box.high[i]);
      }
    }
    return hull;
  }
  /// A sensor can be there: T_body_sensor is rigid, and no box holds it, which would take all near
  /// returns. Without boxes any can.
  [[nodiscard]] bool allows(const Matrix34d& T_body_sensor) const noexcept {
    return count == 0 ||
           (check_rigid(T_body_sensor) == Status::kOk && !holds(T_body_sensor.col(3)));
  }

  friend constexpr bool operator==(const RobotBody&, const RobotBody&) = default;
};

/// A box somewhere in the map: of another robot.
struct PlacedBox {
  Matrix34d T_box_map = Matrix34d::Identity();  ///< Map coordinates to those of the box's frame.
  BodyBox box{};
};

/// The body as a sensor sees it.
class BodyView {
 public:
  /// Of no body.
  BodyView() noexcept = default;
  /// body.allows(T_body_sensor). O(boxes).
  BodyView(const RobotBody& body, const Matrix34d& T_body_sensor) noexcept
      : body_(body), T_body_sensor_(T_body_sensor) {
    for (const BodyBox& box : body.used()) {
      Point3d farthest;
      for (Eigen::Index i = 0; i < 3; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const double low = std::abs(static_cast<double>(box.low[k]) - T_body_sensor(i, 3));
        const double high = std::abs(static_cast<double>(box.high[k]) - T_body_sensor(i, 3));
        farthest[i] = low > high ? low : high;
      }
      // A rotation may be off by what check_rigid() lets pass.
      const double square_m2 = 1.01 * squared_norm(farthest);
      if (square_m2 > farthest_square_m2_) farthest_square_m2_ = square_m2;
    }
  }
  /// square_m2: |p_sensor|^2. Costs one comparison where the point is farther than the body, else
  /// a transform and six comparisons a box.
  [[nodiscard]] bool holds(const Point3d& p_sensor, double square_m2) const noexcept {
    return square_m2 <= farthest_square_m2_ && body_.holds(apply(T_body_sensor_, p_sensor));
  }
  /// What is farther from the sensor than this is not on the body; negative: there is none.
  [[nodiscard]] double farthest_square_m2() const noexcept { return farthest_square_m2_; }
  /// The ray from the sensor along p_sensor meets the body. O(boxes).
  [[nodiscard]] bool is_met_by(const Point3d& p_sensor) const noexcept {
    return body_.count > 0 &&
           body_.is_met_by(T_body_sensor_.col(3), T_body_sensor_.leftCols<3>() * p_sensor);
  }

 private:
  RobotBody body_{};
  Matrix34d T_body_sensor_ = Matrix34d::Identity();
  double farthest_square_m2_ = -1.0;  ///< Of what may be on the body, from the sensor.
};

}  // namespace tessera
