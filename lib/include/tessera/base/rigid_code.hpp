// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A rigid transform in 22 bytes, as frames of submaps are stored and sent. Whoever uses such a
// frame uses the one that the code stands for, its origin included, so that all compute with the
// same bits.
#pragma once

#include <array>
#include <cstdint>

#include "tessera/base/geometry.hpp"

namespace tessera {

/// The translation in steps of 2^-12 m. The rotation as a quaternion of length 1 without its
/// largest part, which is positive; the others in steps of 2^-23, in the order w x y z.
struct RigidCode {
  static constexpr double kMostMetres = 524'287.0;
  static constexpr std::size_t kBytes = 22;
  std::array<std::int32_t, 3> translation{};
  std::array<std::int32_t, 3> rotation{};
  std::uint8_t largest = 0;  ///< Which part is left out.
  friend constexpr bool operator==(const RigidCode&, const RigidCode&) = default;
};

/// The code nearest to a transform: no point within 200 m of the frame's origin moves by more than
/// 0.3 mm. Fails with kInvalidArgument iff T is not rigid (check_rigid), or a part of its
/// translation is over kMostMetres. O(1).
[[nodiscard]] Result<RigidCode> encode_rigid(const Matrix34d& T) noexcept;
/// The transform of a code; its rotation is exact to rounding. Fails with kCorrupt iff encode_rigid
/// gives no such code. O(1).
[[nodiscard]] Result<Matrix34d> decode_rigid(const RigidCode& code) noexcept;
/// The transform of the code of a transform. Fails as encode_rigid.
[[nodiscard]] Result<Matrix34d> round_rigid(const Matrix34d& T) noexcept;

}  // namespace tessera
