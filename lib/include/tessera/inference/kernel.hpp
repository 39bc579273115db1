// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sparse kernel k_0 (Melkumyan and Ramos, IJCAI 2009; paper eq. 5), tabulated over the squared
// distance.
#pragma once

#include <array>
#include <cstddef>

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

/// k_0 for eps_0 = 1 by its formula, r = d / D >= 0. For tables and tests; not for hot loops.
constexpr double kernel_exact(double r) noexcept {
  if (!(r < 1.0)) return 0.0;
  const double a = 2.0 * detail::kPi * r;
  return (2.0 + detail::exact_cos(a)) * (1.0 - r) / 3.0 +
         detail::exact_sin(a) / (2.0 * detail::kPi);  // eq. (5)
}

/// k_0 as a quadratic in each of kSegments equal parts of [0, 1) in s = (d / D)^2: no square root,
/// 3 kB of table. Error against the formula: at most 4e-7 absolute, and 3.1e-6 relative wherever
/// k_0
/// >= 2^-12.
class KernelTable {
 public:
  static constexpr int kSegments = 256;

  /// k_0 at s = (d / D)^2. s >= 0; 0 from s = 1 on.
  [[nodiscard]] static float at(float s) noexcept {
    if (!(s < 1.0F)) return 0.0F;
    const float scaled = s * static_cast<float>(kSegments);
    const int segment = static_cast<int>(scaled);
    const Segment& c = kTable[static_cast<std::size_t>(segment)];
    const float t = scaled - static_cast<float>(segment);
    return c.a + t * (c.b + t * c.c);
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

 private:
  struct Segment {
    float a = 0.0F;
    float b = 0.0F;
    float c = 0.0F;
  };
  static constexpr std::array<Segment, kSegments> make_table() noexcept;
  static const std::array<Segment, kSegments> kTable;
};

}  // namespace tessera
