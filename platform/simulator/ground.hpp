// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The street's floor: road, kerb strips of parking bays and grass, sidewalks and undulating
// gardens, as a height field. Street frame: x along the street, y to the left of it, z up, metres;
// the street's middle is the origin.
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/primitive.hpp"

namespace tessera::street {

constexpr double kRoadHalfWidth_m = 3.6;
constexpr double kVergeEnd_m = 5.9;     ///< Outer edge of the kerb strip, from the street's axis.
constexpr double kSidewalkEnd_m = 8.3;  ///< Outer edge of the sidewalk.
constexpr double kStreetHalfWidth_m = 20.0;
constexpr double kVergeSlot_m = 6.0;  ///< Length of one parking bay or grass strip.

class Ground {
 public:
  /// half_length_m: of the street; the floor ends there, rays beyond hit nothing.
  Ground(std::uint64_t seed, double half_length_m);

  /// Defined everywhere, also beyond the floor's end.
  [[nodiscard]] double height(double x_m, double y_m) const;
  /// The height without kerbs and grass, for cars.
  [[nodiscard]] double road_height(double x_m) const;
  [[nodiscard]] Surface surface(double x_m, double y_m) const;
  /// True if the kerb strip's slot (x from slot * kVergeSlot_m) on the side (+1 left, -1 right) is
  /// a parking bay.
  [[nodiscard]] bool is_parking(int side, int slot) const;

  /// Shortens `nearest` to the point where the ray goes below the floor, if nearer; vertical rays
  /// are ignored.
  void meet(const Ray& ray, Hit& nearest) const;

 private:
  [[nodiscard]] double stored_height(double x_m, double y_m) const;
  [[nodiscard]] double gap(const Ray& ray, double t) const;
  void record(const Ray& ray, double t, Hit& nearest) const;
  bool walk_tile(const Ray& ray, double from, double to, Hit& nearest) const;

  std::uint64_t seed_;
  double half_length_m_;
  int columns_ = 0;
  int rows_ = 0;
  int tile_columns_ = 0;
  std::vector<double> heights_;  ///< Vertices, rows of constant y.
  std::vector<double> crests_;   ///< The highest vertex of each tile.
};

}  // namespace tessera::street
