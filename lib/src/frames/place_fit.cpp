// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/internal/place_fit.hpp"

#include "tessera/base/rigid.hpp"

namespace tessera {

void PlaceFit::begin(const MapSketch& a, const MapSketch& b, const Matrix34d& T_a_b,
                     const Point3d& pivot_b, const Plan& plan) noexcept {
  a_ = &a;
  b_ = &b;
  plan_ = plan;
  T_a_b_ = T_a_b;
  pivot_a_ = apply(T_a_b, pivot_b);
  round_ = 0;
  is_held_ = true;
  is_checking_ = false;
  begin_round();
}

void PlaceFit::begin_round() noexcept {
  if (round_ < plan_.rounds.size() && is_held_) {
    fit_.begin(*a_, *b_, T_a_b_, pivot_a_, plan_.rounds[round_], plan_.fitted);
    return;
  }
  is_checking_ = true;
  check_.begin(*a_, *b_, T_a_b_, plan_.checked);
}

bool PlaceFit::step() noexcept {
  if (is_checking_) return check_.count(kStepChecked);
  if (!fit_.add(kStepFitted)) return false;
  is_held_ = fit_.solve();
  T_a_b_ = fit_.transform();
  pivot_a_ = fit_.sums().middle_a;
  ++round_;
  begin_round();
  return false;
}

}  // namespace tessera
