// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/nearest.hpp"

namespace tessera {

namespace {

/// Blocks by rings of cubes around the point's own, until no ring can hold anything nearer.
class NearestSearch {
 public:
  NearestSearch(const LocalMap& map, const Point3f& p_map, double radius_m) noexcept
      : map_(map), p_map_(p_map.cast<double>()), nearest_m_(radius_m) {}

  [[nodiscard]] NearestVoxel run(BlockCoord centre) noexcept {
    const double block_m = kBlockEdge * map_.lattice().resolution_m();
    // The centres of ring k are over k - 1 blocks from any point of the block in the middle.
    for (int ring = 0; (ring - 1) * block_m < nearest_m_; ++ring) visit_ring(centre, ring);
    if (found_.found) found_.estimate = map_.query(found_.voxel);
    return found_;
  }

 private:
  void visit_ring(BlockCoord centre, int ring) noexcept {
    for (int dz = -ring; dz <= ring; ++dz) {
      for (int dy = -ring; dy <= ring; ++dy) {
        const bool face = dz == -ring || dz == ring || dy == -ring || dy == ring;
        const int step = face || ring == 0 ? 1 : 2 * ring;
        for (int dx = -ring; dx <= ring; dx += step)
          visit_block({centre.x + dx, centre.y + dy, centre.z + dz});
      }
    }
  }
  void visit_block(BlockCoord coord) noexcept {
    const Block* const block = map_.find(coord);
    if (block == nullptr || (map_.only_labels_occupy() && !block->has_labels())) return;
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      const unsigned observed =
          map_.only_labels_occupy() ? map_.observed_labels(*block, octet) : 0xffU;
      for (int v = 0; v < kOctetVoxels; ++v) {
        if (((observed >> static_cast<unsigned>(v)) & 1U) != 0)
          visit_voxel(*block, voxel_at(coord, octet, v));
      }
    }
  }
  void visit_voxel(const Block& block, VoxelCoord voxel) noexcept {
    const double distance_m = norm(map_.lattice().center_of(voxel) - p_map_);
    const bool nearer = found_.found ? distance_m < nearest_m_ : distance_m <= nearest_m_;
    if (!nearer || map_.state(block, voxel) != VoxelState::kOccupied) return;
    nearest_m_ = distance_m;
    found_.found = true;
    found_.voxel = voxel;
    found_.distance_m = distance_m;
  }

  const LocalMap& map_;
  Point3d p_map_;
  double nearest_m_;
  NearestVoxel found_{};
};

}  // namespace

Result<NearestVoxel> nearest_occupied(const LocalMap& map, const Point3f& p_map,
                                      double radius_m) noexcept {
  const Lattice lattice = map.lattice();
  const double most_m = kMostNearestBlocks * kBlockEdge * lattice.resolution_m();
  if (!(radius_m > 0.0) || !(radius_m <= most_m)) return Status::kInvalidArgument;
  const Result<VoxelCoord> voxel = lattice.voxel_of(p_map);
  if (!voxel.ok()) return voxel.status();
  return NearestSearch(map, p_map, radius_m).run(block_of(*voxel));
}

}  // namespace tessera
