// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The surface of a set of voxels: faces that no other voxel of the set covers, corners shared.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pictures/ply.hpp"

namespace tessera {

/// Integer coordinates: of voxels from the first one, of corners from that voxel's lowest corner.
struct LatticePoint {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  friend constexpr bool operator==(const LatticePoint&, const LatticePoint&) = default;
};

struct MeshCorner {
  LatticePoint at;
  Color color;
  friend constexpr bool operator==(const MeshCorner&, const MeshCorner&) = default;
};

/// Quads are counter-clockwise seen from outside.
struct VoxelMesh {
  std::array<double, 3> origin_m{};  ///< The corner (0, 0, 0), map frame.
  std::vector<MeshCorner> corners;
  std::vector<std::array<std::uint32_t, 4>> quads;
  std::uint64_t voxels = 0;
  std::uint64_t left_out = 0;  ///< Not finite, too far away, or repeated.
};

[[nodiscard]] VoxelMesh make_voxel_mesh(std::span<const PlyVoxel> voxels, float resolution_m);

}  // namespace tessera
