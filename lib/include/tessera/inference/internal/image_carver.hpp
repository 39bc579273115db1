// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Carving by the image of a scan: blocks are compared with what the scan saw, from coarse to fine,
// and voxels in front of it are free (docs/design/theory.md, Carving by the image of the scan).
#pragma once

#include "tessera/base/internal/lane_width.hpp"
#include "tessera/inference/internal/carve_image.hpp"
#include "tessera/inference/internal/free_space.hpp"
#include "tessera/inference/internal/scan_points.hpp"

namespace tessera {

struct CarveSlab;
struct CarveSlabs;

class ImageCarver {
 public:
  /// Work of one block whose voxels are compared, in ray steps.
  static constexpr std::uint64_t kBlockSteps = 32;
  /// Steps from one reading of the clock to the next.
  static constexpr std::uint64_t kStepBatch = 1024;

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return CarveImage::required_bytes() + arena_bytes<std::byte>(kKeptBytes);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<ImageCarver> make(Arena& arena,
                                                LaneWidth lanes = LaneWidth::kWidest) noexcept;
  ImageCarver() noexcept = default;

  /// Makes the image of a scan's returns. O(returns + pixels).
  void see(const ScanPoints& points, const InferenceConfig& config) noexcept;
  /// Marks what is free in the image, nearest first in rings of doubling distance. Ends where the
  /// ray blocks are full, most_steps are done, or the time that to_write and what is marked take is
  /// all that is left. True: all of it is marked. Whatever is cut off one scan comes sooner in the
  /// next, so then marks depend on the scans before. O(blocks on the surface of free space + free
  /// blocks).
  bool carve(const Lattice& lattice, const FreeSpaceConfig& config, FreeSpace& free_space,
             ScanWork& work, std::uint64_t to_write, std::uint64_t most_steps) noexcept;
  /// The voxels of a block, of the lattice of the last carve(), that the scan saw through: farther
  /// than the voxel by margin_voxels along the face's axis. O(512).
  [[nodiscard]] VoxelMask seen_through(BlockCoord block, SeenBy by,
                                       float margin_voxels) const noexcept;
  /// The same by kAll of one point, for the lattice of the last carve(). O(1).
  [[nodiscard]] bool sees_through(const Point3f& p_map, float margin_voxels) const noexcept;
  /// From the sensor to the block's centre there is no more than the farthest return and a block.
  [[nodiscard]] bool in_reach(BlockCoord block) const noexcept;
  /// Steps of the last carve().
  [[nodiscard]] std::uint64_t steps() const noexcept { return steps_; }

 private:
  /// What the slabs of a block are compared with: it depends on the face, and on where the block is
  /// along the face's axis, alone.
  struct KeptSlabs;
  static constexpr std::size_t kKept = 64;
  static constexpr std::size_t kKeptBytes = kKept * 200;
  /// 2^level blocks a side; block (x, y, z) 2^level is its lowest.
  struct Node {
    BlockCoord at;
    int level = 0;
  };
  /// From the sensor to the nearest and the farthest corner, metres.
  struct Box {
    Point3d low;
    Point3d high;
  };
  /// Blocks whose nearest voxel is so far from the sensor.
  struct Shell {
    double inner_m = 0.0;
    double outer_m = 0.0;
  };

  [[nodiscard]] Box box_of(const Node& node) const noexcept;
  [[nodiscard]] static bool meets_grid(const Node& node) noexcept;
  /// False: nothing in the box is free on that face, or of the shell.
  [[nodiscard]] bool may_be_free(int face, const Box& box, const Shell& shell) const noexcept;
  bool carve_face(int face, const Shell& shell, FreeSpace& free_space, ScanWork& work,
                  std::uint64_t to_write, std::uint64_t most_steps) noexcept;
  bool carve_node(int face, const Node& root, const Shell& shell, FreeSpace& free_space,
                  ScanWork& work, std::uint64_t to_write, std::uint64_t most_steps) noexcept;
  /// False: the ray blocks are full.
  bool carve_block(int face, BlockCoord block, FreeSpace& free_space) noexcept;
  [[nodiscard]] const KeptSlabs& slabs_of(int face, std::int32_t at, const Box& box) noexcept;

  /// What the slabs' voxels are compared with: their depth in metres -> the values.
  template <class Choose>
  void choose_slabs(int face, const Box& box, Choose&& choose, CarveSlab* slabs) const noexcept;
  /// slabs: of a block, where they are chosen.
  void compare(int face, const Box& box, CarveSlabs& slabs,
               std::array<std::uint64_t, kBlockEdge>& words) const noexcept;
  /// Takes out of a face's words what is beyond the range limit. first_m: the lowest voxel's
  /// centre.
  void keep_in_range(const Point3d& first_m, int axis,
                     std::array<std::uint64_t, kBlockEdge>& words) const noexcept;

  CarveImage image_{};
  KeptSlabs* kept_ = nullptr;  ///< kKept of them, by the lower bits of the place.
  void (*compare_)(const CarveSlabs& slabs) noexcept = nullptr;
  Point3d origin_map_ = Point3d::Zero();
  double range_m_ = 0.0;
  double resolution_m_ = 1.0;
  double margin_m_ = 0.0;
  std::uint64_t steps_ = 0;
  std::uint64_t asked_ = 0;  ///< Steps at the last reading of the clock.
  unsigned turn_ = 0;        ///< How often a carve() was cut off: another face, and side, is first.
};

}  // namespace tessera
