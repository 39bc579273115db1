// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Least squares between the surfaces of two sketches, each with its mean and covariance.
#pragma once

#include <cstdint>

#include "tessera/frames/map_sketch.hpp"

namespace tessera {

/// What surfaces say about a small motion of b about a pivot: the weighted normal equations.
struct FitSums {
  Matrix6 information{};  ///< Translation in m, then rotation in rad, along a's axes.
  Vector6 right{};
  Point3d middle_a = Point3d::Zero();  ///< Sum of the pairs' places.
  double squares = 0.0;                ///< Sum of weighted squares.
  double weight = 0.0;                 ///< Sum of weights.
  std::uint32_t pairs = 0;
};

/// Whether two surfaces were seen from opposite sides: they are the faces of something thin, and
/// not one surface. rotation: from the frame of moving to that of fixed. O(1).
[[nodiscard]] bool are_opposite(const MapSketch::Surface& moving, const Matrix3& rotation,
                                const MapSketch::Surface& fixed) noexcept;

/// A round of a Gauss-Newton scheme on T_a_b, in pieces. Each surface of b is paired with that of a
/// whose mean is nearest; what is minimised is the sum of d^T (C_a + R C_b R^T + floor^2 I)^-1 d,
/// with robust weights. Source: Stoyanov, Magnusson, Andreasson, Lilienthal, Fast and Accurate Scan
/// Registration through Minimization of the Distance between Compact 3D NDT Representations, IJRR
/// 2012; here with a Geman-McClure weight, and less where labels differ.
class SurfaceFit {
 public:
  /// How far a round looks.
  struct Round {
    double reach_cells = 1.0;  ///< Pairs are at most so far apart.
    double floor_m = 0.05;
  };

  /// most_surfaces: of b, evenly taken. pivot_a: about which the motion is.
  void begin(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b, const Point3d& pivot_a,
             const Round& round, std::uint32_t most_surfaces) noexcept;
  /// Pairs so many more surfaces. True iff all are. O(surfaces) times 27 look-ups.
  bool add(std::uint32_t surfaces) noexcept;
  /// After all: T_a_b after the round. False, and it stays, iff the surfaces do not hold it. O(1).
  [[nodiscard]] bool solve() noexcept;
  [[nodiscard]] const Matrix34d& transform() const noexcept { return T_a_b_; }
  [[nodiscard]] const FitSums& sums() const noexcept { return sums_; }
  [[nodiscard]] const Point3d& pivot_a() const noexcept { return pivot_a_; }

 private:
  void add_surface(const MapSketch::Surface& moving) noexcept;

  const MapSketch* a_ = nullptr;
  const MapSketch* b_ = nullptr;
  Matrix34d T_a_b_ = Matrix34d(Matrix34d::Identity());
  Matrix3 rotation_{};
  Point3d pivot_a_ = Point3d::Zero();
  Round round_;
  FitSums sums_;
  std::uint32_t stride_ = 1;
  std::uint32_t next_ = 0;
};

}  // namespace tessera
