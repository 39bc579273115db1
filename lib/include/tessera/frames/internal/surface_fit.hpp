// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Least squares between the surfaces of two sketches, each with its mean and covariance.
#pragma once

#include <cstdint>

#include "tessera/frames/map_sketch.hpp"

namespace tessera {

/// One step of a Gauss-Newton scheme on T_a_b. Each surface of b is paired with that of a whose
/// mean is nearest; what is minimised is the sum of d^T (C_a + R C_b R^T + floor^2 I)^-1 d, with
/// robust weights. Source: Stoyanov, Magnusson, Andreasson, Lilienthal, Fast and Accurate Scan
/// Registration through Minimization of the Distance between Compact 3D NDT Representations, IJRR
/// 2012; here with a Geman-McClure weight, and less where labels differ.
struct SurfaceFit {
  double reach_cells = 1.5;  ///< Pairs are at most so far apart.
  double floor_m = 0.05;
  std::uint32_t most_surfaces = 2'048;  ///< Of b, evenly taken.

  struct Outcome {
    Matrix34d T_a_b;        ///< After the step.
    Matrix6 information{};  ///< Of a small motion about pivot_a: translation in m, rotation in rad.
    Point3d pivot_a = Point3d::Zero();
    Point3d middle_a = Point3d::Zero();  ///< Mean of the pairs: the next step's pivot.
    double squares = 0.0;                ///< Sum of weighted squares.
    double weight = 0.0;                 ///< Sum of weights.
    std::uint32_t pairs = 0;
    std::uint32_t tried = 0;
    bool solved = false;  ///< Else T_a_b is as before.
  };
  /// O(most_surfaces) times 27 look-ups.
  [[nodiscard]] Outcome step(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b,
                             const Point3d& pivot_a) const noexcept;
};

}  // namespace tessera
