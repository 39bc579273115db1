// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/base/rigid_code.hpp"

#include <cmath>

#include "tessera/base/internal/quaternion.hpp"

namespace tessera {

namespace {

constexpr double kStepsPerMetre = 4096.0;
constexpr double kRotationSteps = 8'388'608.0;  // 2^23
/// No part but the largest is over the square root of a half.
constexpr std::int32_t kMostRotation = 5'931'642;

/// To the nearest step, halves away from 0.
std::int32_t steps(double value) noexcept {
  return static_cast<std::int32_t>(value < 0.0 ? value - 0.5 : value + 0.5);
}

/// The rotation without this part, which is not 0.
void set_rotation(const Quaternion& q, std::size_t largest, RigidCode& code) noexcept {
  const double sign = q[largest] < 0.0 ? -1.0 : 1.0;
  code.largest = static_cast<std::uint8_t>(largest);
  std::size_t next = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i != largest) code.rotation[next++] = steps(sign * q[i] * kRotationSteps);
  }
}

}  // namespace

/// Where parts are about as large as each other, as in a quarter of a turn, rounding may make
/// another one the largest: a transform that is that of a code gets that code.
Result<RigidCode> encode_rigid(const Matrix34d& T) noexcept {
  if (check_rigid(T) != Status::kOk) return Status::kInvalidArgument;
  RigidCode code;
  for (int row = 0; row < 3; ++row) {
    if (!(std::abs(T(row, 3)) <= RigidCode::kMostMetres)) return Status::kInvalidArgument;
    code.translation[static_cast<std::size_t>(row)] = steps(T(row, 3) * kStepsPerMetre);
  }
  constexpr double kAsLarge = 1e-6;
  const Quaternion q = rotation_of(T);
  std::size_t largest = 0;
  for (std::size_t i = 1; i < 4; ++i) {
    if (std::abs(q[i]) > std::abs(q[largest])) largest = i;
  }
  for (std::size_t i = 0; i < 4; ++i) {
    if (std::abs(q[i]) < std::abs(q[largest]) - kAsLarge) continue;
    set_rotation(q, i, code);
    const Result<Matrix34d> decoded = decode_rigid(code);
    if (decoded.ok() && *decoded == T) return code;
  }
  set_rotation(q, largest, code);
  return code;
}

Result<Matrix34d> decode_rigid(const RigidCode& code) noexcept {
  constexpr auto kMostTranslation =
      static_cast<std::int32_t>(RigidCode::kMostMetres * kStepsPerMetre);
  if (code.largest > 3) return Status::kCorrupt;
  Quaternion q{};
  double rest = 1.0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (i == code.largest) continue;
    const std::int32_t part = code.rotation[next++];
    if (part < -kMostRotation || part > kMostRotation) return Status::kCorrupt;
    q[i] = static_cast<double>(part) / kRotationSteps;
    rest -= q[i] * q[i];
  }
  // The largest of four parts is at least a half, but for what rounding takes.
  if (!(rest >= 0.2499)) return Status::kCorrupt;
  q[code.largest] = std::sqrt(rest);
  normalise(q);
  for (const std::int32_t part : code.translation) {
    if (part < -kMostTranslation || part > kMostTranslation) return Status::kCorrupt;
  }
  const auto metres = [&](std::size_t i) {
    return static_cast<double>(code.translation[i]) / kStepsPerMetre;
  };
  return transform_of(q, {metres(0), metres(1), metres(2)});
}

Result<Matrix34d> round_rigid(const Matrix34d& T) noexcept {
  const Result<RigidCode> code = encode_rigid(T);
  if (!code.ok()) return code.status();
  return decode_rigid(*code);
}

}  // namespace tessera
