// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The kernel of the hot loops against its formula as libm computes it.
#include "tessera/inference/kernel.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <iostream>

namespace tessera {
namespace {

constexpr double kTwoPi = 6.283185307179586476925;

double by_libm(double s) {
  const double r = std::sqrt(s);
  return s < 1.0 ? (2.0 + std::cos(kTwoPi * r)) * (1.0 - r) / 3.0 + std::sin(kTwoPi * r) / kTwoPi
                 : 0.0;
}

struct Errors {
  double absolute = 0.0;
  double relative = 0.0;  ///< Where the kernel is at least 2^-12.
  double absolute_at = 0.0;
  double relative_at = 0.0;
};

Errors sweep() {
  Errors worst;
  constexpr int kSteps = 8000000;
  for (int i = 0; i < kSteps; ++i) {
    const auto s = static_cast<float>((i + 0.37) / kSteps);
    const double exact = by_libm(static_cast<double>(s));
    const double error = std::abs(static_cast<double>(Kernel::at(s)) - exact);
    if (error > worst.absolute) {
      worst.absolute = error;
      worst.absolute_at = static_cast<double>(s);
    }
    if (exact < 1.0 / 4096.0 || error / exact <= worst.relative) continue;
    worst.relative = error / exact;
    worst.relative_at = static_cast<double>(s);
  }
  return worst;
}

}  // namespace

TEST_CASE("kernel: within 4e-7, and 1.6e-6 relative wherever the kernel is at least 2^-12") {
  const Errors worst = sweep();
  std::cout << "kernel: largest error " << worst.absolute << " at s = " << worst.absolute_at
            << ", relative " << worst.relative << " at s = " << worst.relative_at << '\n';
  CHECK(worst.absolute <= 4e-7);
  CHECK(worst.relative <= 1.6e-6);
}

TEST_CASE("kernel: 1 at the point, 0 from the length on, never under 0 by more than its error") {
  CHECK(Kernel::at(0.0F) == 1.0F);
  CHECK(Kernel::at(1.0F) == 0.0F);
  CHECK(Kernel::at(7.5F) == 0.0F);
  CHECK(Kernel::at(std::nextafter(1.0F, 0.0F)) < 1e-6F);
  float least = 1.0F;
  for (int i = 0; i < 100000; ++i)
    least = std::fmin(least, Kernel::at(static_cast<float>(i) * 1e-5F));
  CAPTURE(least);
  CHECK(least >= -4e-7F);
}

TEST_CASE("kernel: the formula in the library is libm's to 1e-14") {
  double worst = 0.0;
  for (int i = 0; i <= 20000; ++i) {
    const double r = i / 20000.0;
    worst = std::fmax(worst, std::abs(kernel_exact(r) - by_libm(r * r)));
  }
  CHECK(worst < 1e-14);
}

TEST_CASE("kernel: beyond the support of a value no contribution reaches it") {
  for (const double value : {1e-6, 1.0 / 4096.0, 0.01, 0.3, 0.9}) {
    CAPTURE(value);
    const auto support = static_cast<double>(Kernel::support(value));
    CHECK(by_libm(support) < value);
    CHECK(by_libm(support - 1e-3) > value);
  }
  CHECK(Kernel::support(0.0) == 1.0F);
}

}  // namespace tessera
