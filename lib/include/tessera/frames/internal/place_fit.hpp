// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One place of b in a: fitted in rounds from far to near, and then checked, in pieces.
#pragma once

#include <cstdint>
#include <span>

#include "tessera/frames/internal/overlap_check.hpp"
#include "tessera/frames/internal/surface_fit.hpp"

namespace tessera {

class PlaceFit {
 public:
  /// What is done with a place.
  struct Plan {
    std::span<const SurfaceFit::Round> rounds;  ///< May be none.
    std::uint32_t fitted = 1;                   ///< Surfaces of b.
    std::uint32_t checked = 1;                  ///< Surfaces of each.
  };
  /// Surfaces that a step looks at.
  static constexpr std::uint32_t kStepFitted = 1'024;
  static constexpr std::uint32_t kStepChecked = 512;

  /// pivot_b: about which the first round's motion is.
  void begin(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b, const Point3d& pivot_b,
             const Plan& plan) noexcept;
  /// True iff all is done. O(1): kStepFitted * 27 or kStepChecked * 113 look-ups.
  bool step() noexcept;
  [[nodiscard]] const Matrix34d& transform() const noexcept { return T_a_b_; }
  /// Whether surfaces held it in each round.
  [[nodiscard]] bool is_held() const noexcept { return is_held_; }
  [[nodiscard]] const Agreement& agreement() const noexcept { return check_.agreement(); }
  /// Of the last round.
  [[nodiscard]] const SurfaceFit& fit() const noexcept { return fit_; }

 private:
  void begin_round() noexcept;

  const MapSketch* a_ = nullptr;
  const MapSketch* b_ = nullptr;
  Plan plan_;
  Matrix34d T_a_b_ = Matrix34d(Matrix34d::Identity());
  Point3d pivot_a_ = Point3d::Zero();
  SurfaceFit fit_;
  OverlapCheck check_;
  std::size_t round_ = 0;
  bool is_held_ = true;
  bool is_checking_ = false;
};

}  // namespace tessera
