// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/base/rigid_code.hpp"

#include <cmath>

#include "tessera/base/internal/quaternion.hpp"

namespace tessera {

namespace {

constexpr double kStepsPerMetre = 4096.0;
constexpr std::int32_t kRotationSteps = 1 << 23;

/// The rotation without this part, which is not 0.
void set_rotation(const Quaternion& q, std::size_t part, RigidCode& code) noexcept {
  const ThreeParts parts = without_part(q, part, kRotationSteps);
  code.rotation = parts.steps;
  code.largest = parts.largest;
}

}  // namespace

/// Where parts are about as large as each other, as in a quarter of a turn, rounding may make
/// another one the largest: a transform that is that of a code gets that code.
Result<RigidCode> encode_rigid(const Matrix34d& T) noexcept {
  if (check_rigid(T) != Status::kOk) return Status::kInvalidArgument;
  RigidCode code;
  for (int row = 0; row < 3; ++row) {
    if (!(std::abs(T(row, 3)) <= RigidCode::kMostMetres)) return Status::kInvalidArgument;
    code.translation[static_cast<std::size_t>(row)] = nearest_step(T(row, 3) * kStepsPerMetre);
  }
  constexpr double kAsLarge = 1e-6;
  const Quaternion q = rotation_of(T);
  const std::size_t largest = largest_of(q);
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
  Quaternion q{};
  if (!with_largest({code.rotation, code.largest}, kRotationSteps, q)) return Status::kCorrupt;
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
