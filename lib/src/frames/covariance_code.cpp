// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "covariance_code.hpp"

#include "six_by_six.hpp"
#include "tessera/base/rigid_code.hpp"

namespace tessera {

namespace {

// All steps are powers of two, so that L L^T of a decoded L is exact, and the L that is found from
// it is the same again.
constexpr double kAboutSteps = 16.0;
constexpr double kShiftSteps = 16'384.0;    // 2^14 a metre
constexpr double kTurnSteps = 1'048'576.0;  // 2^20 a radian
constexpr double kMostSteps = 8'388'607.0;  // of 24 bits with a sign

constexpr double steps_of_row(std::size_t row) noexcept {
  return row < 3 ? kShiftSteps : kTurnSteps;
}

void write_i24(ByteWriter& to, std::int32_t value) noexcept {
  const auto bits = static_cast<std::uint32_t>(value);
  to.u16(static_cast<std::uint16_t>(bits & 0xffffU));
  to.u8(static_cast<std::uint8_t>(bits >> 16U & 0xffU));
}

std::int32_t read_i24(ByteReader& from) noexcept {
  const std::uint32_t low = from.u16();
  const std::uint32_t high = from.u8();
  return static_cast<std::int32_t>(high << 24U | low << 8U) >> 8;
}

/// To the nearest step, halves away from 0. False: it does not fit into 24 bits.
bool to_steps(double value, std::int32_t& steps) noexcept {
  const double nearest = value < 0.0 ? value - 0.5 : value + 0.5;
  if (!(nearest > -kMostSteps && nearest < kMostSteps + 1.0)) return false;
  steps = static_cast<std::int32_t>(nearest);
  return true;
}

/// No farther than a transform may be: who computes with it refuses more.
bool is_near(std::int32_t steps) noexcept {
  constexpr double kMost = RigidCode::kMostMetres * kAboutSteps;
  return steps <= kMost && steps >= -kMost;
}

}  // namespace

bool write_covariance(ByteWriter& to, const FrameCovariance& covariance) noexcept {
  SixBySix L{};
  if (!factor_six(covariance.values, L)) return false;
  for (int axis = 0; axis < 3; ++axis) {
    std::int32_t steps = 0;
    if (!to_steps(covariance.about_a(axis) * kAboutSteps, steps) || !is_near(steps)) return false;
    write_i24(to, steps);
  }
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      std::int32_t steps = 0;
      const double part = L[FrameCovariance::index(row, column)] * steps_of_row(row);
      if (!to_steps(part, steps)) return false;
      if (row == column && steps < 1) steps = 1;
      write_i24(to, steps);
    }
  }
  return true;
}

bool read_covariance(ByteReader& from, FrameCovariance& covariance) noexcept {
  constexpr auto at = FrameCovariance::index;
  constexpr auto kMost = static_cast<std::int32_t>(kMostSteps);
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t steps = read_i24(from);
    if (!is_near(steps)) return false;
    covariance.about_a(axis) = static_cast<double>(steps) / kAboutSteps;
  }
  SixBySix L{};
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      const std::int32_t steps = read_i24(from);
      if (steps < -kMost || (row == column && steps < 1)) return false;
      L[at(row, column)] = static_cast<double>(steps) / steps_of_row(row);
    }
  }
  for (std::size_t row = 0; row < FrameCovariance::kSize; ++row) {
    for (std::size_t column = 0; column <= row; ++column) {
      double sum = 0.0;
      for (std::size_t k = 0; k <= column; ++k) sum += L[at(row, k)] * L[at(column, k)];
      covariance.values[at(row, column)] = sum;
    }
  }
  return true;
}

}  // namespace tessera
