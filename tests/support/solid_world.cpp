// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "support/solid_world.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

namespace tessera {

namespace {

constexpr double kWall_m = 2.0;  // Nobody sees what is behind it.

/// The voxels that a view's box may be in.
std::vector<VoxelCoord> voxels_of(const WorldView& view) {
  std::array<double, 3> low{1e9, 1e9, 1e9};
  std::array<double, 3> high{-1e9, -1e9, -1e9};
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Point3d p =
        apply(view.T_map_world, {(corner & 1U) != 0 ? view.high_world.x() : view.low_world.x(),
                                 (corner & 2U) != 0 ? view.high_world.y() : view.low_world.y(),
                                 (corner & 4U) != 0 ? view.high_world.z() : view.low_world.z()});
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p(static_cast<int>(i)));
      high[i] = std::max(high[i], p(static_cast<int>(i)));
    }
  }
  std::vector<VoxelCoord> voxels;
  const auto place = [&](double m) { return floor_to_int(m / view.resolution_m); };
  for (int z = place(low[2]); z <= place(high[2]); ++z) {
    for (int y = place(low[1]); y <= place(high[1]); ++y) {
      for (int x = place(low[0]); x <= place(high[0]); ++x) voxels.push_back({x, y, z});
    }
  }
  if (view.backwards) std::reverse(voxels.begin(), voxels.end());
  return voxels;
}

bool is_surface(const SolidWorld& world, const Point3d& p, double step_m) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-step_m, step_m}) {
      Point3d beside = p;
      beside(axis) += side;
      if (world.at(beside) == nullptr) return true;
    }
  }
  return false;
}

}  // namespace

const Solid* SolidWorld::at(const Point3d& p_world) const noexcept {
  for (const Solid& solid : solids) {
    if (solid.contains(p_world)) return &solid;
  }
  return nullptr;
}

SolidWorld room_of(double length_m, double width_m, double height_m,
                   const std::vector<Solid>& things) {
  SolidWorld world{things};
  const double w = kWall_m;
  world.solids.push_back({{-w, -w, -w}, {length_m + w, width_m + w, 0.0}, 1});
  world.solids.push_back({{-w, -w, 0.0}, {0.0, width_m + w, height_m}, 2});
  world.solids.push_back({{length_m, -w, 0.0}, {length_m + w, width_m + w, height_m}, 2});
  world.solids.push_back({{0.0, -w, 0.0}, {length_m, 0.0, height_m}, 2});
  world.solids.push_back({{0.0, width_m, 0.0}, {length_m, width_m + w, height_m}, 2});
  return world;
}

SolidWorld large_hall() {
  return room_of(30.0, 18.0, 4.0,
                 {{{4.0, 3.0, 0.0}, {5.0, 4.0, 4.0}, 3},
                  {{11.0, 12.5, 0.0}, {11.8, 13.3, 4.0}, 3},
                  {{14.0, 4.0, 0.0}, {19.0, 5.0, 2.4}, 3},
                  {{21.0, 11.0, 0.0}, {22.0, 16.0, 3.0}, 3},
                  {{7.0, 8.0, 0.0}, {9.0, 9.0, 1.2}, 3},
                  {{25.0, 2.0, 0.0}, {26.5, 6.0, 1.6}, 3},
                  {{16.0, 13.0, 0.0}, {17.0, 14.5, 2.0}, 3}});
}

SolidWorld other_hall() {
  return room_of(24.0, 15.0, 4.0,
                 {{{9.0, 6.5, 0.0}, {9.8, 7.3, 4.0}, 3},
                  {{3.0, 10.0, 0.0}, {8.0, 11.0, 2.2}, 3},
                  {{15.0, 2.0, 0.0}, {16.0, 9.0, 2.6}, 3},
                  {{19.5, 11.0, 0.0}, {21.0, 12.0, 1.4}, 3}});
}

WorldMap::WorldMap(const MapConfig& config, const ClassTable& classes)
    : memory(required_bytes(config)) {
  Arena arena = memory.arena();
  REQUIRE(LocalMap::make_at(map, arena, config, classes) == Status::kOk);
}

void add_world(const SolidWorld& world, const WorldView& view, LocalMap& map) {
  const Matrix34d T_world_map = inverse(view.T_map_world);
  const Solid box{view.low_world, view.high_world};
  bool all_fit = true;
  for (const VoxelCoord voxel : voxels_of(view)) {
    const Point3d p = apply(T_world_map, map.lattice().center_of(voxel));
    if (!box.contains(p)) continue;
    const Solid* const solid = world.at(p);
    Status status = Status::kOk;
    if (solid == nullptr)
      status = carve(map, voxel);
    else if (is_surface(world, p, view.resolution_m))
      status = hit(map, voxel, solid->label, 4.0F);
    all_fit = all_fit && status == Status::kOk;
  }
  REQUIRE(all_fit);
}

std::unique_ptr<WorldMap> map_of(const SolidWorld& world, const WorldView& view,
                                 const ClassTable& classes) {
  MapConfig config = config_of_pages(3'000);
  config.resolution_m = view.resolution_m;
  auto made = std::make_unique<WorldMap>(config, classes);
  add_world(world, view, made->map);
  return made;
}

Matrix34d frame_of(double yaw_deg, double tilt_deg, double axis_deg, const Point3d& shift_m) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Eigen::Vector3d axis{std::cos(axis_deg * kDegree), std::sin(axis_deg * kDegree), 0.0};
  const Eigen::Matrix3d R = (Eigen::AngleAxisd(tilt_deg * kDegree, axis) *
                             Eigen::AngleAxisd(yaw_deg * kDegree, Eigen::Vector3d::UnitZ()))
                                .toRotationMatrix();
  Matrix34d T;
  T.leftCols<3>() = R;
  T.col(3) = shift_m;
  return T;
}

}  // namespace tessera
