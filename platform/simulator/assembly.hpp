// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Assembles the solids of one object in the object's own frame: x forward, y left, z up from its
// foot, metres.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "simulator/primitive.hpp"

namespace tessera::street {

/// Pose of an object in the street frame; yaw in radians, counter-clockwise from x.
struct Placement {
  Eigen::Vector3d base = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

class Assembly {
 public:
  Assembly(std::vector<Primitive>& solids, const Placement& at, std::uint32_t object)
      : solids_(solids), at_(at), object_(object) {}

  /// foot: centre of the foot; half: half lengths in x and y.
  void box(const Eigen::Vector3d& foot, const Eigen::Vector2d& half, double height,
           const Surface& surface) {
    tapered(foot, half, half, height, surface);
  }
  void tapered(const Eigen::Vector3d& foot, const Eigen::Vector2d& half, const Eigen::Vector2d& top,
               double height, const Surface& surface) {
    add(Shape::kTaperedBox, foot, {half.x(), half.y(), height}, surface).top = top;
  }
  void cylinder(const Eigen::Vector3d& foot, double radius, double height, const Surface& surface) {
    add(Shape::kCylinder, foot, {radius, radius, height}, surface);
  }
  void ellipsoid(const Eigen::Vector3d& centre, const Eigen::Vector3d& half,
                 const Surface& surface) {
    add(Shape::kEllipsoid, centre, half, surface);
  }

 private:
  Primitive& add(Shape shape, const Eigen::Vector3d& foot, const Eigen::Vector3d& extent,
                 const Surface& surface) {
    Primitive solid;
    solid.shape = shape;
    solid.cos_yaw = std::cos(at_.yaw_rad);
    solid.sin_yaw = std::sin(at_.yaw_rad);
    solid.base =
        at_.base + Eigen::Vector3d(solid.cos_yaw * foot.x() - solid.sin_yaw * foot.y(),
                                   solid.sin_yaw * foot.x() + solid.cos_yaw * foot.y(), foot.z());
    solid.extent = extent;
    solid.surface = surface;
    solid.object = object_;
    solids_.push_back(solid);
    return solids_.back();
  }

  std::vector<Primitive>& solids_;
  Placement at_;
  std::uint32_t object_;
};

}  // namespace tessera::street
