// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "camera_mathematics.hpp"

namespace tessera {

namespace {

/// Sign changes in rising order.
struct Crossings {
  std::array<double, Polynomial::kMostDegree> places{};
  std::size_t count = 0;
};

/// Those of a polynomial between the given ones of its derivative.
Crossings crossings_between(const Polynomial& polynomial, const Crossings& turns,
                            double high) noexcept {
  Crossings found;
  double from = 0.0;
  double at_from = polynomial.at(from);
  for (std::size_t i = 0; i <= turns.count; ++i) {
    const double to = i < turns.count ? turns.places[i] : high;
    const double at_to = polynomial.at(to);
    if ((at_from < 0.0) != (at_to < 0.0) && found.count < found.places.size())
      found.places[found.count++] = crossing(polynomial, from, to);
    from = to;
    at_from = at_to;
  }
  return found;
}

}  // namespace

double crossing(const Polynomial& polynomial, double low, double high) noexcept {
  constexpr int kHalvings = 60;
  const bool below_at_low = polynomial.at(low) < 0.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    ((polynomial.at(middle) < 0.0) == below_at_low ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double first_crossing(const Polynomial& polynomial, double high) noexcept {
  std::array<Polynomial, Polynomial::kMostDegree> derivatives;
  derivatives[0] = polynomial;
  for (std::size_t i = 1; i < derivatives.size(); ++i)
    derivatives[i] = derivatives[i - 1].derivative();
  Crossings crossings;
  for (std::size_t i = derivatives.size(); i-- > 0;)
    crossings = crossings_between(derivatives[i], crossings, high);
  return crossings.count > 0 ? crossings.places[0] : high;
}

double angle_of(double aside, double along) noexcept {
  // atan((2 i + 1) / 16): what is left after taking off the nearest is under 1/16 in its tangent.
  constexpr std::array<double, 8> kArcs{
      0.06241880999595735, 0.18534794999569476, 0.3028848683749714, 0.4124104415973873,
      0.5123894603107377,  0.6022873461349642,  0.6823165548747481, 0.7531512809621944};
  const double forward = along < 0.0 ? -along : along;
  const bool steep = aside > forward;
  const double small = steep ? forward : aside;
  const double large = steep ? aside : forward;
  const int piece = static_cast<int>(8.0 * (small / large));
  const auto i = static_cast<std::size_t>(piece < 7 ? piece : 7);
  const double c = (2.0 * static_cast<double>(i) + 1.0) / 16.0;
  const double t = (small - c * large) / (large + c * small);
  const double s = t * t;
  const double series =
      1.0 + s * (-1.0 / 3 +
                 s * (1.0 / 5 + s * (-1.0 / 7 + s * (1.0 / 9 + s * (-1.0 / 11 + s * (1.0 / 13))))));
  const double arc = kArcs[i] + t * series;
  const double acute = steep ? 0.5 * kPi - arc : arc;
  return along < 0.0 ? kPi - acute : acute;
}

SineCosine sine_cosine(double angle_rad) noexcept {
  // Of a quarter of the angle by their series, then doubled twice.
  const double x = 0.25 * angle_rad;
  const double s = x * x;
  double sine = 1.0;
  double cosine = 1.0;
  for (int n = 9; n >= 1; --n) {
    const double k = 2.0 * n;
    sine = 1.0 - s / (k * (k + 1.0)) * sine;
    cosine = 1.0 - s / (k * (k - 1.0)) * cosine;
  }
  sine *= x;
  for (int doubling = 0; doubling < 2; ++doubling) {
    const double twice = 2.0 * sine * cosine;
    cosine = cosine * cosine - sine * sine;
    sine = twice;
  }
  return {sine, cosine};
}

}  // namespace tessera
