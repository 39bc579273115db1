// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Streets on a grid, several kilometres of them with loops, for long drives: house fronts, kerbs,
// parked cars, lamps and trees, all of them boxes along the axes. So a ray costs a few boxes a
// metre, its hit is exact, and how far a place lies from a true surface is known. Nothing moves.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "simulator/primitive.hpp"
#include "simulator/random.hpp"

namespace tessera::street {

struct StreetGridConfig {
  std::uint64_t seed = 1;
  int blocks = 8;          ///< City blocks along each axis, 1 to 64; a street more.
  double pitch_m = 60.0;   ///< From the middle of a street to that of the next, from 40.
  double street_m = 16.0;  ///< From front to front, pavements included; 12 to pitch_m - 24.
};

/// Frame: x and y along the streets, z up; the first crossing is the origin, the road is z = 0.
class StreetGrid {
 public:
  explicit StreetGrid(const StreetGridConfig& config);

  [[nodiscard]] const StreetGridConfig& config() const { return config_; }
  /// Of all streets, metres.
  [[nodiscard]] double length_m() const {
    return 2.0 * (config_.blocks + 1) * config_.blocks * config_.pitch_m;
  }
  /// The middle of a crossing; x and y from 0 to config().blocks.
  [[nodiscard]] Eigen::Vector2d crossing(int x, int y) const {
    return {x * config_.pitch_m, y * config_.pitch_m};
  }
  /// Shortens `nearest` to the first surface that the ray hits from outside, if that is nearer.
  /// O(cells that it crosses).
  void meet(const Ray& ray, Hit& nearest) const;
  /// From a place to the nearest surface, inside of things too; most_m if none is nearer.
  /// O(boxes within most_m).
  [[nodiscard]] double distance_m(const Eigen::Vector3d& p, double most_m) const;

  /// A solid: from one corner to the opposite one.
  struct Box {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
    Surface surface;
  };
  [[nodiscard]] const std::vector<Box>& boxes() const { return boxes_; }

 private:
  void add(const Eigen::Vector3d& low, const Eigen::Vector3d& high, RawId id);
  void add_block(int x, int y);
  void add_front(Random& random, const Eigen::Vector2d& low, const Eigen::Vector2d& high, int side);
  void add_kerb_side(Random& random, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                     int side);
  void sort_into_cells();
  [[nodiscard]] int column_of(double metres) const;

  StreetGridConfig config_;
  std::vector<Box> boxes_;
  double low_m_ = 0.0;                ///< Of the cells, on both axes.
  int cells_ = 0;                     ///< Along each axis.
  std::vector<std::uint32_t> first_;  ///< Of each cell, by rows of y, in numbers_; one more.
  std::vector<std::uint32_t> numbers_;
};

}  // namespace tessera::street
