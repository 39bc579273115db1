// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where a polynomial of a camera's distortion first changes its sign, and where a rising one has a
// value.
#pragma once

#include <array>
#include <cstddef>

namespace tessera {

inline constexpr double kPi = 3.141592653589793;

struct Polynomial {
  static constexpr std::size_t kMostDegree = 9;

  std::array<double, kMostDegree + 1> factors{};  ///< Of x^0, x^1, ...

  [[nodiscard]] double at(double x) const noexcept {
    double value = 0.0;
    for (std::size_t i = factors.size(); i-- > 0;) value = value * x + factors[i];
    return value;
  }
  [[nodiscard]] Polynomial derivative() const noexcept {
    Polynomial result;
    for (std::size_t i = 1; i < factors.size(); ++i)
      result.factors[i - 1] = static_cast<double>(i) * factors[i];
    return result;
  }
};

/// Where the polynomial's sign changes between low and high, whose signs differ: 60 bisections.
[[nodiscard]] double crossing(const Polynomial& polynomial, double low, double high) noexcept;

/// The first place in (0, high) where the polynomial changes its sign; high if there is none. Its
/// derivatives' places part the range into pieces on which it rises or falls throughout.
[[nodiscard]] double first_crossing(const Polynomial& polynomial, double high) noexcept;

/// The angle from the axis, 0 .. pi, of a point that is `aside` (>= 0) from it and `along` it; not
/// both 0. Within 1e-15 of the true one.
[[nodiscard]] double angle_of(double aside, double along) noexcept;

struct SineCosine {
  double sine;
  double cosine;
};
/// Of an angle in 0 .. pi, within 2e-15.
[[nodiscard]] SineCosine sine_cosine(double angle_rad) noexcept;

}  // namespace tessera
