// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ray intersection of the street's solids. Each is solved in its own frame with the ray's origin
// moved to the closest approach first: at 100 m the squared terms would otherwise be too inexact
// for a pole of 3 cm.
#include "simulator/primitive.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "simulator/random.hpp"

namespace tessera::street {
namespace {

constexpr double kLeafVoxel_m = 0.14;

Eigen::Vector3d to_own_frame(const Primitive& p, const Eigen::Vector3d& v) {
  return {p.cos_yaw * v.x() + p.sin_yaw * v.y(), -p.sin_yaw * v.x() + p.cos_yaw * v.y(), v.z()};
}

Eigen::Vector3d to_world(const Primitive& p, const Eigen::Vector3d& v) {
  return {p.cos_yaw * v.x() - p.sin_yaw * v.y(), p.sin_yaw * v.x() + p.cos_yaw * v.y(), v.z()};
}

/// Cuts the chord to the half space normal . x <= offset.
void clip(Chord& chord, const Eigen::Vector3d& o, const Eigen::Vector3d& d,
          const Eigen::Vector3d& normal, double offset) {
  const double speed = normal.dot(d);
  const double gap = offset - normal.dot(o);
  if (std::abs(speed) < 1e-12) {
    if (gap < 0.0) chord.leave_m = -kNoHit;
    return;
  }
  const double t = gap / speed;
  if (speed > 0.0) {
    chord.leave_m = std::min(chord.leave_m, t);
  } else if (t > chord.enter_m) {
    chord.enter_m = t;
    chord.normal = normal;
  }
}

Chord whole_line() { return {-kNoHit, kNoHit, Eigen::Vector3d::UnitZ()}; }

Chord box_chord(const Primitive& p, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  const double height = p.extent.z();
  Chord chord = whole_line();
  clip(chord, o, d, Eigen::Vector3d::UnitZ(), height);
  clip(chord, o, d, -Eigen::Vector3d::UnitZ(), 0.0);
  for (int axis = 0; axis < 2; ++axis) {
    if (chord.enter_m >= chord.leave_m) break;
    // The four sides lean inwards by (foot - top) over the height.
    const double lean = (p.extent[axis] - p.top[axis]) / height;
    const double scale = 1.0 / std::sqrt(1.0 + lean * lean);
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal.z() = lean * scale;
    normal[axis] = scale;
    clip(chord, o, d, normal, p.extent[axis] * scale);
    normal[axis] = -scale;
    clip(chord, o, d, normal, p.extent[axis] * scale);
  }
  return chord;
}

/// Distances at which a ray enters and leaves a sphere: |o + t d| <= 1 in the given coordinates,
/// with any point o on the line.
bool solve_round(const Eigen::Vector3d& o, const Eigen::Vector3d& d, Chord& chord) {
  const double dd = d.squaredNorm();
  if (dd < 1e-18) return o.squaredNorm() <= 1.0;
  const double nearest = -o.dot(d) / dd;
  const double miss2 = (o + nearest * d).squaredNorm();
  if (miss2 >= 1.0) return false;
  const double half = std::sqrt((1.0 - miss2) / dd);
  chord.enter_m = nearest - half;
  chord.leave_m = nearest + half;
  return true;
}

Chord cylinder_chord(const Primitive& p, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  Chord chord = whole_line();
  const double inverse = 1.0 / p.extent.x();
  const Eigen::Vector3d flat_o(o.x() * inverse, o.y() * inverse, 0.0);
  const Eigen::Vector3d flat_d(d.x() * inverse, d.y() * inverse, 0.0);
  if (!solve_round(flat_o, flat_d, chord)) return {};
  const Eigen::Vector3d side = flat_o + chord.enter_m * flat_d;
  chord.normal = side;
  clip(chord, o, d, Eigen::Vector3d::UnitZ(), p.extent.z());
  clip(chord, o, d, -Eigen::Vector3d::UnitZ(), 0.0);
  return chord;
}

Chord ellipsoid_chord(const Primitive& p, const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  Chord chord;
  const Eigen::Vector3d round_o = o.cwiseQuotient(p.extent);
  const Eigen::Vector3d round_d = d.cwiseQuotient(p.extent);
  if (!solve_round(round_o, round_d, chord)) return {};
  chord.normal = (round_o + chord.enter_m * round_d).cwiseQuotient(p.extent).normalized();
  return chord;
}

std::int64_t leaf_index(double coordinate_m) {
  return static_cast<std::int64_t>(std::floor(coordinate_m / kLeafVoxel_m));
}

/// The first solid voxel along the chord of a porous solid.
void meet_leaves(const Primitive& p, const Ray& ray, const Chord& chord, Hit& nearest) {
  const double end = std::min(chord.leave_m, nearest.range_m);
  for (double t = std::max(chord.enter_m, 0.0); t < end; t += 0.8 * kLeafVoxel_m) {
    const Eigen::Vector3d at = ray.origin + t * ray.direction;
    const std::uint64_t leaf = hash_of(p.object, Stream::kLeaf, leaf_index(at.x()),
                                       leaf_index(at.y()), leaf_index(at.z()));
    if (unit_of(leaf) >= p.surface.fill) continue;
    nearest = {t, 0.3 + 0.7 * unit_of(mix(leaf)), p.surface, p.object};
    return;
  }
}

}  // namespace

Bounds bounds_of(const Primitive& p) {
  Eigen::Vector3d reach = p.extent;
  if (p.shape == Shape::kCylinder) reach.y() = reach.x();
  if (p.shape == Shape::kTaperedBox) reach.head<2>() = reach.head<2>().cwiseMax(p.top);
  const double x = std::abs(p.cos_yaw) * reach.x() + std::abs(p.sin_yaw) * reach.y();
  const double y = std::abs(p.sin_yaw) * reach.x() + std::abs(p.cos_yaw) * reach.y();
  const double below = p.shape == Shape::kEllipsoid ? reach.z() : 0.0;
  return {p.base - Eigen::Vector3d(x, y, below), p.base + Eigen::Vector3d(x, y, reach.z())};
}

Chord chord_of(const Primitive& p, const Ray& ray) {
  const Eigen::Vector3d d = to_own_frame(p, ray.direction);
  const Eigen::Vector3d far_o = to_own_frame(p, ray.origin - p.base);
  const double shift = -far_o.dot(d);
  const Eigen::Vector3d o = far_o + shift * d;
  Chord chord;
  switch (p.shape) {
    case Shape::kTaperedBox:
      chord = box_chord(p, o, d);
      break;
    case Shape::kCylinder:
      chord = cylinder_chord(p, o, d);
      break;
    case Shape::kEllipsoid:
      chord = ellipsoid_chord(p, o, d);
      break;
  }
  chord.enter_m += shift;
  chord.leave_m += shift;
  chord.normal = to_world(p, chord.normal);
  return chord;
}

void meet(const Primitive& p, const Ray& ray, Hit& nearest) {
  const Chord chord = chord_of(p, ray);
  if (chord.enter_m >= chord.leave_m || chord.leave_m <= 0.0) return;
  if (chord.enter_m >= nearest.range_m) return;
  if (p.surface.fill < 1.0) {
    meet_leaves(p, ray, chord, nearest);
    return;
  }
  if (chord.enter_m <= 0.0) return;
  nearest = {chord.enter_m, std::abs(chord.normal.dot(ray.direction)), p.surface, p.object};
}

}  // namespace tessera::street
