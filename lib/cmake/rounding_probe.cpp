// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ends with 0 iff round_to_float rounds where the compiler sees the conversion back to double. The
// pattern is the one that gcc 12 folds for a plain cast: two neighbours of an array, from -O2 on.
#include "tessera/base/internal/rounding.hpp"

namespace {

struct Point {
  double at[3];
};

/// As a point is registered and brought to voxels of an edge.
Point round_and_divide(const double* p, double edge) noexcept {
  const float rounded[3] = {tessera::round_to_float(p[0]), tessera::round_to_float(p[1]),
                            tessera::round_to_float(p[2])};
  return {{static_cast<double>(rounded[0]) / edge, static_cast<double>(rounded[1]) / edge,
           static_cast<double>(rounded[2]) / edge}};
}

/// Called through this, so that nothing is known of the arguments.
Point (*volatile called)(const double*, double) noexcept = round_and_divide;

}  // namespace

int main() {
  // Not floats, and halfway cases, which go to the even one; then the nearest floats.
  constexpr double kGiven[2][3] = {{800000.03, -0.1, 16777217.0}, {1e-46, 800000.01, -16777219.0}};
  constexpr double kWanted[2][3] = {{800000.0, -0.100000001490116119384765625, 16777216.0},
                                    {0.0, 800000.0, -16777220.0}};
  for (int i = 0; i < 2; ++i) {
    const Point got = called(kGiven[i], 0.5);
    for (int axis = 0; axis < 3; ++axis)
      if (got.at[axis] != 2.0 * kWanted[i][axis]) return 1;
  }
  return 0;
}
