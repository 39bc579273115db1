// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far a search for the transform between two maps reaches, with a guess and without.
#pragma once

#include <optional>

#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/frames/frame_finder.hpp"

namespace tessera {

/// T_a_b of two maps that have a frame each, a rotation to rounding even where these are not quite.
[[nodiscard]] inline Matrix34d between_frames(const Matrix34d& T_global_a,
                                              const Matrix34d& T_global_b) noexcept {
  const Matrix34d T = product(inverse(T_global_a), T_global_b);
  return transform_of(rotation_of(T), {T(0, 3), T(1, 3), T(2, 3)});
}

/// A search is much narrower where there is a guess; metres, and steps of two degrees.
struct SearchReach {
  double xy_m = 0.0;
  double z_m = 0.0;
  int yaw_steps = 0;
};
/// Of a guess by people.
inline constexpr SearchReach kNearGuess{10.0, 3.0, 10};
/// Of a frame that is in use, to judge it.
inline constexpr SearchReach kNearGiven{3.0, 2.0, 4};

[[nodiscard]] inline FrameQuestion question_near(const Matrix34d& T_a_b,
                                                 const SearchReach& reach) noexcept {
  FrameQuestion question;
  question.T_a_b_guess = T_a_b;
  question.is_guess = true;
  question.reach_m = reach.xy_m;
  question.reach_z_m = reach.z_m;
  question.yaw_steps = reach.yaw_steps;
  return question;
}

/// Where it was found before: it is fitted anew from there.
[[nodiscard]] inline FrameQuestion refinement_of(const Matrix34d& T_a_b) noexcept {
  FrameQuestion question = question_near(T_a_b, kNearGiven);
  question.is_refinement = true;
  return question;
}

/// Searches near the guess; without one anywhere, around the identity.
[[nodiscard]] inline FrameQuestion question_of(const std::optional<Matrix34d>& guess) noexcept {
  return guess ? question_near(*guess, kNearGuess) : FrameQuestion{};
}

}  // namespace tessera
