// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How often a range-image network errs on each class, and what it then says instead.
#pragma once

#include <cstdint>

#include "simulator/street_class.hpp"

namespace tessera::street {

/// The static class that a network is trained to say for the truth: cars and people whether they
/// move or not.
constexpr RawId learned_id(RawId truth) noexcept {
  if (truth == RawId::kMovingCar) return RawId::kCar;
  if (truth == RawId::kMovingPerson) return RawId::kPerson;
  return truth;
}

/// Classes whose objects are mistaken as a whole; the others are surfaces, mistaken in patches.
bool is_thing(RawId learned) noexcept;

/// The probability that a point away from any border is mistaken. cos_incidence: 1 is head-on.
double mistake_probability(RawId learned, double range_m, double cos_incidence) noexcept;

/// What a mistaken thing, or a mistaken patch of a surface, is called: the class at `share` in
/// [0, 1) of the distribution of its wrong answers. Of a thing only what it resembles as a whole,
/// not what may stand beside it. Also for unlabelled truth, where every answer is wrong. May be a
/// class that does not occur in the street.
std::uint16_t mistaken_for(RawId learned, double share) noexcept;

/// What a point that is mistaken on its own is called; `share` as above, of all wrong answers.
std::uint16_t stray_answer(RawId learned, double share) noexcept;

}  // namespace tessera::street
