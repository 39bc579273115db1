// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A scan as it comes from a sensor, and its points after registration: transformed into the map
// frame, refused or placed in the grid once, and labelled.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/geometry.hpp"
#include "tessera/base/internal/lanes.hpp"
#include "tessera/base/robot_body.hpp"
#include "tessera/base/status.hpp"
#include "tessera/grid/lattice.hpp"
#include "tessera/registration/label_limits.hpp"

namespace tessera {

/// A place that somebody says is occupied and the robot's own map says is free.
struct WatchedPoint {
  std::array<float, 3> p_map{};  ///< Metres, map frame.
  std::uint32_t watch = 0;       ///< By which the asker knows it.
  std::uint16_t row = 0;
  // Set by the scan.
  bool is_seen_through = false;
  bool is_hit = false;  ///< A return is in its voxel.
};

/// Labelled range data in the sensor frame. A view: the arrays stay the caller's and must outlive
/// the call.
struct ScanView {
  Matrix34d T_map_sensor =
      Matrix34d::Identity();  ///< [R | t], metres; sensor coordinates to map coordinates.
  const float* points =
      nullptr;  ///< x y z of point i at points[i * stride_floats], metres, sensor frame.
  std::size_t stride_floats = 4;  ///< 3 for packed x y z, 4 with an intensity that is not read.
  std::size_t count = 0;
  const std::uint8_t* components =
      nullptr;  ///< Component of point i: 1 .. C, or C + 1 if unlabelled; null: all unlabelled.
                ///< Of label j of point i at components[i * labels_per_point + j].
  const float* weights = nullptr;  ///< Weight of point i, 0 .. kMaxWeight; null: all 1. What
                                   ///< a point gives a voxel counts from kLeastCount on.
  /// Where the sensor is on the robot; of use with InferenceConfig::body alone.
  Matrix34d T_body_sensor = Matrix34d::Identity();
  /// Not 0: nothing came back from the direction of point i, whose length and weight do not count;
  /// null: all are returns. They free space as InferenceConfig::no_return_range_m says.
  const std::uint8_t* no_return = nullptr;
  /// Where other robots are, with what they may be off by: a return in a box is no hit, and its ray
  /// frees space up to where it comes to the box. The first TeammateFilter::kMost, but for those
  /// that are no boxes (RobotBody::is_valid, check_rigid) and those that the sensor is in.
  std::span<const PlacedBox> teammates{};
  /// Points of which integrating tells whether the scan surely saw through them, or met something
  /// there. With Carving::kImage alone.
  std::span<WatchedPoint> watched{};
  std::size_t labels_per_point = 1;  ///< 1 .. kMostLabels.
  /// Of each of components, in 255ths of the point's weight. The rest of a point's is unlabelled:
  /// in a map of compact counts it goes to their rest, in one of dense counts to C + 1. A point
  /// whose labels sum to over 255 is unlabelled whole, and counted. null: each point has one label,
  /// with all of its weight.
  const std::uint8_t* label_weights = nullptr;
};

/// The largest weight of a point, so that no sum of a scan comes near a float's limit.
inline constexpr float kMaxWeight = 1e6F;

/// A point after registration. Invariant of every point that registration or thinning gives: p_map
/// is finite, and voxel contains it. place_point() alone makes such points.
struct ScanPoint {
  Point3f p_map = Point3f::Zero();  ///< Metres, map frame.
  float weight = 1.0F;
  VoxelCoord voxel{};          ///< Of the map's lattice.
  std::uint8_t component = 0;  ///< Of its best label.
  // Its other labels, the heaviest first.
  std::uint8_t second = 0;
  std::uint8_t third = 0;
  /// In the same order, a byte each from the lowest: 255ths, 0 after the last. What they leave of
  /// 255 is unlabelled.
  std::uint32_t label_weights = kOneLabel;
  [[nodiscard]] constexpr bool has_one_label() const noexcept { return label_weights == kOneLabel; }
};

/// The point at p_map (metres) with its voxel. Fails with kOutOfRange iff p_map is not finite or
/// outside the grid. O(1).
[[nodiscard]] inline Result<ScanPoint> place_point(const Lattice& lattice, const Point3f& p_map,
                                                   float weight = 1.0F,
                                                   std::uint8_t component = 0) noexcept {
  const Result<VoxelCoord> voxel = lattice.voxel_of(p_map);
  if (!voxel.ok()) return voxel.status();
  return ScanPoint{.p_map = p_map, .weight = weight, .voxel = *voxel, .component = component};
}

/// The smallest and the largest coordinates of points, metres.
struct PointBounds {
  Point3f low;
  Point3f high;
};
/// points: at least one. O(points).
[[nodiscard]] inline PointBounds bounds_of(std::span<const ScanPoint> points) noexcept {
  const auto lanes_of = [](const ScanPoint& point) {
    return Float4{point.p_map.x(), point.p_map.y(), point.p_map.z(), 0.0F};
  };
  Float4 low = lanes_of(points[0]);
  Float4 high = low;
  for (const ScanPoint& point : points) {
    const Float4 at = lanes_of(point);
    low = at < low ? at : low;
    high = at > high ? at : high;
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}
/// In place of a component: a ray ends there, though not at a hit, and what is behind is not known.
inline constexpr std::uint8_t kSightEnds = 1;
/// Not a component: marks a point that was not admitted.
inline constexpr std::uint8_t kRefused = 255;

/// p_map = R p_sensor + t, computed in double and rounded once.
[[nodiscard]] inline Point3f transform(const Matrix34d& T_map_sensor,
                                       const float* p_sensor) noexcept {
  const double x = static_cast<double>(p_sensor[0]);
  const double y = static_cast<double>(p_sensor[1]);
  const double z = static_cast<double>(p_sensor[2]);
  const auto row = [&](int r) {
    return round_to_float(T_map_sensor(r, 0) * x + T_map_sensor(r, 1) * y + T_map_sensor(r, 2) * z +
                          T_map_sensor(r, 3));
  };
  return {row(0), row(1), row(2)};
}

}  // namespace tessera
