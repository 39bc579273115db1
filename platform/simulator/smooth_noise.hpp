// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Smooth random fields over one to four coordinates: standard normal at every point, correlated
// over about one unit of the coordinates, independent further away. Pure functions of the hash they
// start from.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "simulator/random.hpp"

namespace tessera::street {

/// Standard normal to within a few percent in the bulk (the sum of four 16-bit uniforms, scaled).
constexpr double normal_of(std::uint64_t hash) noexcept {
  double sum = 0.0;
  for (unsigned shift = 0; shift < 64; shift += 16) {
    sum += static_cast<double>((hash >> shift) & 0xffffU) * 0x1.0p-16;
  }
  constexpr double kSqrt3 = 1.7320508075688772;
  return (sum - 2.0) * kSqrt3;
}

/// Interpolates normals on the integer lattice; the weights are normalised so that the variance is
/// one everywhere.
template <std::size_t kDimensions>
double smooth_normal(std::uint64_t hash, const std::array<double, kDimensions>& at) noexcept {
  std::array<std::int64_t, kDimensions> lattice{};
  std::array<double, kDimensions> blend{};
  for (std::size_t i = 0; i < kDimensions; ++i) {
    const double floor = std::floor(at[i]);
    const double part = at[i] - floor;
    lattice[i] = static_cast<std::int64_t>(floor);
    blend[i] = part * part * (3.0 - 2.0 * part);
  }
  double sum = 0.0;
  double square = 0.0;
  for (std::size_t corner = 0; corner < (std::size_t{1} << kDimensions); ++corner) {
    double weight = 1.0;
    std::uint64_t h = hash;
    for (std::size_t i = 0; i < kDimensions; ++i) {
      const bool upper = ((corner >> i) & 1U) != 0;
      weight *= upper ? blend[i] : 1.0 - blend[i];
      h = mix(h ^ static_cast<std::uint64_t>(lattice[i] + (upper ? 1 : 0)));
    }
    if (weight <= 0.0) continue;
    sum += weight * normal_of(h);
    square += weight * weight;
  }
  return sum / std::sqrt(square);
}

/// The share of a standard normal below x.
inline double normal_share(double x) noexcept { return 0.5 * std::erfc(-x * 0.7071067811865476); }

}  // namespace tessera::street
