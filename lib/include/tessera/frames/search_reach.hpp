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
inline constexpr SearchReach kAnywhere{72.0, 12.0, YawSearch::kYaws / 2};
inline constexpr SearchReach kNearGuess{10.0, 3.0, 10};

/// Searches near the guess; without one anywhere, around the identity.
[[nodiscard]] inline FrameQuestion question_of(const std::optional<Matrix34d>& guess) noexcept {
  const SearchReach& reach = guess ? kNearGuess : kAnywhere;
  FrameQuestion question;
  if (guess) question.T_a_b_guess = *guess;
  question.is_guess = guess.has_value();
  question.reach_m = reach.xy_m;
  question.reach_z_m = reach.z_m;
  question.yaw_steps = reach.yaw_steps;
  return question;
}

}  // namespace tessera
