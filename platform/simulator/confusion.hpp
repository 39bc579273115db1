// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Error rates of a range-image network for each class, and its wrong answers.
#pragma once

#include <cstdint>

#include "simulator/street_class.hpp"

namespace tessera::street {

/// The static class on which a network is trained for a truth: cars and people, moving or not.
constexpr RawId learned_id(RawId truth) noexcept {
  if (truth == RawId::kMovingCar) return RawId::kCar;
  if (truth == RawId::kMovingPerson) return RawId::kPerson;
  return truth;
}

/// Classes with errors for whole objects; the others are surfaces, with errors in patches.
bool is_thing(RawId learned) noexcept;

/// The error probability of a point away from borders. cos_incidence: 1 is head-on.
double mistake_probability(RawId learned, double range_m, double cos_incidence) noexcept;

/// The wrong answer for an object or a patch of a surface: the class at `share` in [0, 1) of the
/// distribution of its wrong answers. For an object only what it resembles as a whole, not its
/// surroundings. Also for unlabelled truth, where every answer is wrong. May be a class that does
/// not occur in the street.
std::uint16_t mistaken_for(RawId learned, double share) noexcept;

/// The wrong answer for a single point; `share` as above, of all wrong answers.
std::uint16_t stray_answer(RawId learned, double share) noexcept;

}  // namespace tessera::street
