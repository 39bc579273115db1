// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Phi: where a contribution's voxels are in the global grid, and back. Both grids have the same
// resolution, so all is in units of voxels. A global voxel takes the local voxel that contains its
// centre, so a rotation leaves no holes; a local voxel that no global voxel takes goes to the one
// that contains its own centre, so nothing is lost. Where the returns of a local voxel were is kept
// (Centroid): then its labels go to where a box around them is. Sums are written out, not Eigen's,
// and nothing of libm is used but the square root, so every machine rounds alike.
#pragma once

#include <array>
#include <span>

#include "tessera/grid/centroid.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {

class GridTransform {
 public:
  /// No shift and no rotation.
  constexpr GridTransform() noexcept = default;
  /// Fails with kInvalidArgument iff the transform is not rigid (check_rigid), or its translation
  /// is over 2^20 voxels on an axis. What is not quite a rotation is made one. O(1).
  [[nodiscard]] static Result<GridTransform> make(const Matrix34d& T_global_local,
                                                  double resolution_m) noexcept;
  /// T_team_local: where a contribution lies in the team's frame if its robot's world lies at
  /// T_team_world, metres. By product(), so that all robots get equal bits; the identity gives
  /// T_world_local itself. Fails as make(). O(1).
  [[nodiscard]] static Result<GridTransform> compose(const Matrix34d& T_team_world,
                                                     const GridTransform& T_world_local,
                                                     double resolution_m) noexcept;
  /// The transform itself, a rotation to rounding, by voxels or by metres. O(1).
  [[nodiscard]] Matrix34d in_voxels() const noexcept;
  [[nodiscard]] Matrix34d in_metres(double resolution_m) const noexcept;
  friend bool operator==(const GridTransform&, const GridTransform&) noexcept = default;

  /// Phi backwards: the local voxel that contains the centre of a global one.
  [[nodiscard]] VoxelCoord to_local(VoxelCoord global) const noexcept {
    if (shift_only_) return global - shift_;
    const double x = global.x + 0.5 - t_[0];
    const double y = global.y + 0.5 - t_[1];
    const double z = global.z + 0.5 - t_[2];
    return {floor_to_int(r_[0] * x + r_[3] * y + r_[6] * z),
            floor_to_int(r_[1] * x + r_[4] * y + r_[7] * z),
            floor_to_int(r_[2] * x + r_[5] * y + r_[8] * z)};
  }

  /// The same for all voxels of a block, by row order, where shift_only() is false. O(512).
  void to_local(BlockCoord global, std::span<VoxelCoord> rows) const noexcept;

  /// Calls visit(VoxelCoord) for the global voxels that get a local voxel's evidence: those that
  /// take it, in the order of (z, y, x), or the one that it goes to. At most eight.
  template <class Visit>
  void for_targets(VoxelCoord local, Visit&& visit) const noexcept {
    for_targets(local, to_global(local), visit);
  }
  /// The same with to_global(local), where that is known.
  template <class Visit>
  void for_targets(VoxelCoord local, const std::array<double, 3>& center,
                   Visit&& visit) const noexcept {
    if (shift_only_)
      return visit(VoxelCoord{local.x + shift_.x, local.y + shift_.y, local.z + shift_.z});
    // A centre in a cube is at most half its diagonal from the cube's own.
    constexpr double kReach = 0.8661;
    std::array<std::int32_t, 3> first{};
    std::array<std::int32_t, 3> last{};
    for (std::size_t i = 0; i < 3; ++i) {
      first[i] = floor_to_int(center[i] - 0.5 - kReach) + 1;
      last[i] = floor_to_int(center[i] - 0.5 + kReach);
    }
    bool taken = false;
    for (std::int32_t z = first[2]; z <= last[2]; ++z) {
      for (std::int32_t y = first[1]; y <= last[1]; ++y) {
        for (std::int32_t x = first[0]; x <= last[0]; ++x) {
          if (to_local({x, y, z}) != local) continue;
          taken = true;
          visit(VoxelCoord{x, y, z});
        }
      }
    }
    if (!taken)
      visit(VoxelCoord{floor_to_int(center[0]), floor_to_int(center[1]), floor_to_int(center[2])});
  }

  /// The corners of a box around a voxel's returns are what stands for them, each for an eighth.
  static constexpr int kBoxCorners = 8;
  /// Of the box's edge, before it is cut off at the voxel's faces; voxels.
  static constexpr float kHalfBox = 0.18F;
  using BoxCorners = std::array<VoxelCoord, kBoxCorners>;
  /// The global voxel that contains each corner, where shift_only() is false, in the order of (z,
  /// y, x). centroid: known.
  [[nodiscard]] BoxCorners box_corners(VoxelCoord local, Centroid centroid) const noexcept;
  /// Calls visit(VoxelCoord) for each of them.
  template <class Visit>
  void for_box_corners(VoxelCoord local, Centroid centroid, Visit&& visit) const noexcept {
    for (const VoxelCoord corner : box_corners(local, centroid)) visit(corner);
  }

  /// The centre of a local voxel, in units of global voxels.
  [[nodiscard]] std::array<double, 3> to_global(VoxelCoord local) const noexcept {
    const double x = local.x + 0.5;
    const double y = local.y + 0.5;
    const double z = local.z + 0.5;
    return {r_[0] * x + r_[1] * y + r_[2] * z + t_[0], r_[3] * x + r_[4] * y + r_[5] * z + t_[1],
            r_[6] * x + r_[7] * y + r_[8] * z + t_[2]};
  }

  /// Voxels of a grid, corners included.
  struct VoxelBox {
    VoxelCoord first;
    VoxelCoord last;
  };
  /// The local voxels that may go to a global block are in this box.
  [[nodiscard]] VoxelBox local_box(BlockCoord global) const noexcept;
  /// The global voxels that those of a local block may go to are in this one.
  [[nodiscard]] VoxelBox global_box(BlockCoord local) const noexcept;
  /// Blocks of a grid, corners included.
  struct BlockRange {
    BlockCoord first;
    BlockCoord last;
  };
  /// The local blocks whose voxels may go to a global block: at most three on an axis.
  [[nodiscard]] BlockRange local_blocks(BlockCoord global) const noexcept {
    return blocks_of(local_box(global));
  }
  /// The global blocks that voxels of a local block may go to: at most three on an axis.
  [[nodiscard]] BlockRange global_blocks(BlockCoord local) const noexcept {
    return blocks_of(global_box(local));
  }

  /// Whether whole voxels go to whole voxels, one to one.
  [[nodiscard]] bool shift_only() const noexcept { return shift_only_; }
  /// By how many, where that is so.
  [[nodiscard]] VoxelCoord shift() const noexcept { return shift_; }

 private:
  [[nodiscard]] static BlockRange blocks_of(const VoxelBox& box) noexcept {
    return {block_of(box.first), block_of(box.last)};
  }
  /// Voxels that a turned cube with this centre and half extent may be in.
  [[nodiscard]] static VoxelBox around(const std::array<double, 3>& center,
                                       const std::array<double, 3>& half) noexcept;

  std::array<double, 9> r_{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< Rotation to the global grid, by rows.
  std::array<double, 3> t_{};                           ///< Voxels.
  VoxelCoord shift_{};
  bool shift_only_ = true;
};

}  // namespace tessera
