// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The solids of the street, and their intersection with rays. World frame, metres, z up.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>

#include "simulator/street_class.hpp"

namespace tessera::street {

constexpr double kNoHit = std::numeric_limits<double>::infinity();

struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  ///< Unit length.
};

/// Where a ray enters and leaves a solid, in metres along the ray, and the outward normal at the
/// entry.
struct Chord {
  double enter_m = kNoHit;
  double leave_m = -kNoHit;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

/// The first hit of a ray.
struct Hit {
  double range_m = kNoHit;
  double cos_incidence = 1.0;
  Surface surface;
  std::uint32_t object = 0;
};

enum class Shape : std::uint8_t {
  kTaperedBox,  ///< Upright; rectangular foot and top of different size. A box, a hip or gable
                ///< roof, a car's cabin.
  kCylinder,    ///< Upright, round.
  kEllipsoid,
};

struct Primitive {
  Shape shape = Shape::kTaperedBox;
  /// Centre of the foot; of the volume for an ellipsoid.
  Eigen::Vector3d base = Eigen::Vector3d::Zero();
  double cos_yaw = 1.0;
  double sin_yaw = 0.0;
  /// Half lengths of the foot in x and y of the solid's own frame (a cylinder's radius twice) and
  /// the full height; an ellipsoid's three half axes.
  Eigen::Vector3d extent = Eigen::Vector3d::Ones();
  /// Half lengths of the top, tapered boxes only.
  Eigen::Vector2d top = Eigen::Vector2d::Ones();
  Surface surface;
  std::uint32_t object = 0;
};

struct Bounds {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(kNoHit);
  Eigen::Vector3d high = Eigen::Vector3d::Constant(-kNoHit);
};

Bounds bounds_of(const Primitive& primitive);

/// The part of the ray inside the solid, as an infinite line; empty (enter >= leave) if they miss.
Chord chord_of(const Primitive& primitive, const Ray& ray);

/// Shortens `nearest` to this solid's first echo if that is nearer. Porous solids let most of the
/// ray through: which of their voxels are solid depends only on the place, so every viewpoint
/// sees the same leaves.
void meet(const Primitive& primitive, const Ray& ray, Hit& nearest);

}  // namespace tessera::street
