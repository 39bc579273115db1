// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which voxels a segment pierces, by testing every voxel of its bounding box against the three
// slabs in double precision.
#pragma once

#include <set>

#include "oracle/label_oracle.hpp"

namespace tessera::oracle {

using Vector = std::array<double, 3>;

/// What a set of segments pierces. Voxels of possible but not of certain are touched within 1e-9 of
/// an edge or corner.
struct Pierced {
  std::set<Voxel> certain;
  std::set<Voxel> possible;

  /// Adds the voxels of a grid of voxel_m that the segment from a to b passes through. O(box
  /// volume).
  void add(const Vector& a, const Vector& b, double voxel_m);
};

}  // namespace tessera::oracle
