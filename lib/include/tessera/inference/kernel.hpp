// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sparse kernel k_0 (Melkumyan and Ramos, IJCAI 2009; paper eq. 5) as a function of the squared
// distance.
#pragma once

#include <cmath>

#include "tessera/base/internal/lanes.hpp"

namespace tessera {

namespace detail {

inline constexpr double kPi = 3.14159265358979323846;

/// sin by its series after reduction to [-pi/2, pi/2]. Own code, because libm's last bits differ
/// between machines and every map must be the same everywhere.
constexpr double exact_sin(double x) noexcept {
  while (x > kPi) x -= 2 * kPi;
  while (x < -kPi) x += 2 * kPi;
  if (x > kPi / 2) x = kPi - x;
  if (x < -kPi / 2) x = -kPi - x;
  double term = x;
  double sum = x;
  for (int n = 1; n < 14; ++n) {
    term *= -x * x / ((2.0 * n) * (2.0 * n + 1.0));
    sum += term;
  }
  return sum;
}
constexpr double exact_cos(double x) noexcept { return exact_sin(x + kPi / 2); }
constexpr double exact_sqrt(double x) noexcept {
  if (x <= 0.0) return 0.0;
  double root = x < 1.0 ? 1.0 : x;
  for (int i = 0; i < 64; ++i) root = 0.5 * (root + x / root);
  return root;
}

}  // namespace detail

/// k_0 for eps_0 = 1 by its formula, r = d / D >= 0. For tests and set-up; not for hot loops.
constexpr double kernel_exact(double r) noexcept {
  if (!(r < 1.0)) return 0.0;
  const double a = 2.0 * detail::kPi * r;
  return (2.0 + detail::exact_cos(a)) * (1.0 - r) / 3.0 +
         detail::exact_sin(a) / (2.0 * detail::kPi);  // eq. (5)
}

/// k_0 for hot loops. It is an odd and entire function of t = 1 - r that starts
/// with t^5, so it is t^5 h(v) with v = 1 - t^2, and a polynomial of degree seven is h to 8e-9. All
/// of its coefficients are positive, so nothing cancels. Error against the formula: at most 4e-7
/// absolute, and 1.6e-6 relative wherever k_0 >= 2^-12. The same operations in the same order for
/// one value and for lanes of them, so the same bits.
class Kernel {
 public:
  /// k_0 at s = (d / D)^2. s >= 0; 0 from s = 1 on.
  [[nodiscard]] static float at(float s) noexcept {
    return of_distance(std::sqrt(s < 1.0F ? s : 1.0F));
  }
  /// Four values of s, any of which may be 1 or more.
  [[nodiscard]] static Float4 at(Float4 s) noexcept {
    const Float4 one = all_lanes(1.0F);
    return of_distance(sqrt4(s < one ? s : one));
  }

  /// k_0 at r = d / D in [0, 1], for a float or for lanes of floats. Never out of line: it is also
  /// compiled for instructions that not every machine has.
  template <class Value>
  [[nodiscard, gnu::always_inline]] static Value of_distance(Value r) noexcept {
    const Value t = 1.0F - r;
    const Value v = r * (2.0F - r);
    Value h = 0.00646472955F * v + 0.0260426402F;
    h = h * v + 0.15969111F;
    h = h * v + 0.608398736F;
    h = h * v + 1.62794662F;
    h = h * v + 2.73004127F;
    h = h * v + 2.50000072F;
    h = h * v + 1.0F;
    const Value u = t * t;
    return (u * u) * (t * h);
  }

  /// The largest s at which k_0 still reaches value, rounded up: beyond it a contribution is surely
  /// under value.
  [[nodiscard]] static constexpr float support(double value) noexcept {
    if (value <= 0.0) return 1.0F;
    double low = 0.0;
    double high = 1.0;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      (kernel_exact(detail::exact_sqrt(middle)) >= value ? low : high) = middle;
    }
    const double padded = high + 1e-5;
    return padded < 1.0 ? static_cast<float>(padded) : 1.0F;
  }
};

}  // namespace tessera
