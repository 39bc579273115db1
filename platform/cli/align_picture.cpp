// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/align_picture.hpp"

#include <array>
#include <set>
#include <vector>

#include "maps/stored_map.hpp"
#include "pictures/picture.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

// Distinguishable with every kind of colour vision, after Okabe and Ito.
constexpr Color kOfFirst{86, 180, 233};
constexpr Color kOfSecond{230, 159, 0};
constexpr Color kOfBoth{60, 60, 60};

template <class Visit>
void for_each_occupied(const LocalMap& map, Visit&& visit) {
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for_each_observed(map, workspace, [&](VoxelCoord voxel, const VoxelEvidence& evidence) {
    if (estimate(evidence, map.reading()).state == VoxelState::kOccupied) visit(voxel);
  });
}

}  // namespace

Outcome<void> write_alignment_png(const LocalMap& a, const LocalMap& b, const Matrix34d& T_a_b,
                                  const std::string& title, const std::string& path) {
  const Lattice lattice = a.lattice();
  const double resolution_m = lattice.resolution_m();
  std::vector<RenderVoxel> voxels;
  const auto add = [&](VoxelCoord voxel, Color color) {
    const Point3d center = lattice.center_of(voxel);
    voxels.push_back({static_cast<float>(center.x()), static_cast<float>(center.y()),
                      static_cast<float>(center.z()), color});
  };
  std::set<std::array<std::int32_t, 3>> of_both;
  for_each_occupied(b, [&](VoxelCoord voxel) {
    const Result<VoxelCoord> there = lattice.voxel_of(apply(T_a_b, b.lattice().center_of(voxel)));
    if (!there.ok()) return;
    if (a.query(*there).state == VoxelState::kOccupied)
      of_both.insert({there->x, there->y, there->z});
    else
      add(*there, kOfSecond);
  });
  for_each_occupied(a, [&](VoxelCoord voxel) {
    add(voxel, of_both.contains({voxel.x, voxel.y, voxel.z}) ? kOfBoth : kOfFirst);
  });
  ImageOptions options;
  options.title = title;
  options.legend = {{"first map", kOfFirst}, {"second map", kOfSecond}, {"both", kOfBoth}};
  TESSERA_TRY(write_png(voxels, static_cast<float>(resolution_m), options, path));
  return {};
}

}  // namespace tessera
