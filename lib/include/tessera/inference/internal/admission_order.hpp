// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The order in which a scan that does not fit is admitted: near before far, sparse before dense.
#pragma once

#include <span>

#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// A registered and thinned scan.
struct AdmissionScene {
  std::span<const ScanPoint> points;  ///< In the grid, at most 2^19 voxels from the sensor.
  std::span<const ScanPoint> rays;    ///< Ends of rays to returns beyond the range limit.
  Point3d origin_map;                 ///< The sensor, metres.
  VoxelCoord origin_voxel;            ///< The voxel that it is in.
  int unit_edge = 2;                  ///< Voxels, 1, 2 or 4; a tile is 4 x 4 x 4 units.
  bool spread = true;                 ///< False: by distance alone, as if both leads were 1.
};

/// How many times nearer than it is the nearest point of a tile counts, and the nearest of a unit.
inline constexpr float kTileLead = 16.0F;
inline constexpr float kUnitLead = 4.0F;

/// Numbers of the points, then (from points.size() on) of the rays, in order of admission:
/// ascending by effective distance. That is the distance to the sensor, divided by kTileLead for
/// the point nearest to the sensor in its tile, by kUnitLead for the nearest in its unit (equally
/// near: the first); for rays as it is. So a budget that ends at effective distance d has all
/// points within d, one of each unit within 4 d, one of each tile within 16 d. Ties: by tile, unit,
/// number; rays last. sort: at least 2 (points + rays) long; the result lies in it. O(n), no other
/// memory.
[[nodiscard]] std::span<const KeyedIndex> order_of_admission(const AdmissionScene& scene,
                                                             std::span<KeyedIndex> sort) noexcept;

}  // namespace tessera
