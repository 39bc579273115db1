// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps of a world of boxes, in any frame: where surfaces are occupied and the space before them is
// free.
#pragma once

#include <memory>
#include <vector>

#include "support/small_map.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

/// A box with its sides along the axes of the world.
struct Solid {
  Point3d low;
  Point3d high;
  int label = 1;

  [[nodiscard]] bool contains(const Point3d& p) const noexcept {
    return p.x() >= low.x() && p.x() < high.x() && p.y() >= low.y() && p.y() < high.y() &&
           p.z() >= low.z() && p.z() < high.z();
  }
};

struct SolidWorld {
  std::vector<Solid> solids;

  /// The solid that contains a point, or null.
  [[nodiscard]] const Solid* at(const Point3d& p_world) const noexcept;
};

/// A room without doors: floor, four thick walls, and what stands in it.
[[nodiscard]] SolidWorld room_of(double length_m, double width_m, double height_m,
                                 const std::vector<Solid>& things);
/// A hall of 30 x 18 m with pillars, shelves and counters, no two alike; of 24 x 15 m, others.
[[nodiscard]] SolidWorld large_hall();
[[nodiscard]] SolidWorld other_hall();

struct WorldView {
  Point3d low_world;  ///< What is seen is in this box.
  Point3d high_world;
  Matrix34d T_map_world = Matrix34d(Matrix34d::Identity());
  double resolution_m = 0.2;
  bool backwards = false;  ///< Voxels are added in the opposite order: the map says the same.
};

/// A map that owns its memory.
struct WorldMap {
  WorldMap(const MapConfig& config, const ClassTable& classes);
  AlignedMemory memory;
  LocalMap map;
};

/// Occupied are voxels whose centre is in a solid at most one voxel behind its surface, free are
/// those in no solid. Classes as their labels.
[[nodiscard]] std::unique_ptr<WorldMap> map_of(const SolidWorld& world, const WorldView& view,
                                               const ClassTable& classes);

/// The same into a map that is there, of this resolution.
void add_world(const SolidWorld& world, const WorldView& view, LocalMap& map);

/// A turn by yaw about z, then by tilt about a horizontal axis, and a shift; degrees and metres.
[[nodiscard]] Matrix34d frame_of(double yaw_deg, double tilt_deg, double axis_deg,
                                 const Point3d& shift_m);

}  // namespace tessera
