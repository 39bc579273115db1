// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/frame_fit.hpp"

#include "tessera/base/rigid.hpp"

namespace tessera {

void FrameFit::add(const Matrix34d& mapped, const Matrix34d& corrected) noexcept {
  const Quaternion turn = rotation_of(product(corrected, inverse(mapped)));
  // q and -q are the same rotation.
  const double sign = dot(turn, rotations_) < 0.0 ? -1.0 : 1.0;
  for (std::size_t i = 0; i < turn.size(); ++i) rotations_[i] += sign * turn[i];
  for (int row = 0; row < 3; ++row) {
    mapped_(row) += mapped(row, 3);
    corrected_(row) += corrected(row, 3);
  }
  ++count_;
}

Result<Matrix34d> FrameFit::fit() const noexcept {
  if (count_ == 0) return Status::kInvalidArgument;
  const double count = count_;
  if (!(dot(rotations_, rotations_) > 0.25 * count * count)) return Status::kInvalidArgument;
  Quaternion turn = rotations_;
  normalise(turn);
  Matrix34d T_world_map = transform_of(turn, Point3d::Zero());
  const Point3d turned = apply(T_world_map, mapped_ / count);
  for (int row = 0; row < 3; ++row) T_world_map(row, 3) = corrected_(row) / count - turned(row);
  return T_world_map;
}

}  // namespace tessera
