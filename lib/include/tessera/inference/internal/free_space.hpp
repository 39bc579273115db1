// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Free space: which voxels a scan's rays passed through. Rays are traced into bitmaps of their own,
// so a voxel counts one pass a scan however many rays cross it, and the map's memory is touched
// once a block.
#pragma once

#include <array>
#include <span>

#include "tessera/grid/internal/key_index.hpp"
#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/range_image.hpp"
#include "tessera/inference/internal/slab_walk.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// One block that rays cross.
struct RayBlock {
  BlockCoord coord;
  SlabHandle block = 0;          ///< The map's block, once opened.
  bool reserved = false;         ///< By the plan of a scan that is admitted point by point.
  bool looked_up = false;        ///< block and free_pages are those of the map.
  std::uint8_t free_pages = 0;   ///< That the map's block has not, of those that rays may need.
  std::uint8_t words_along = 2;  ///< The axis along which passed's words run.
  /// Voxels that a ray passed through: word a & 7 for the voxel at a on that axis, bit
  /// (b & 7) + 8 (c & 7) for b, c on the other two; so a VoxelMask where that axis is z.
  VoxelMask passed{};
  VoxelMask hit{};  ///< Voxels that hold a point of this scan: never carved by it.

  /// Turns passed so that its words run along axis. O(1).
  void turn(int axis) noexcept;
  /// True iff some voxel is to be carved; passed must run along z.
  [[nodiscard]] bool carves() const noexcept {
    std::uint64_t any = 0;
    for (std::size_t z = 0; z < passed.size(); ++z) any |= passed[z] & ~hit[z];
    return any != 0;
  }
};

class FreeSpace {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(
      const ScanCapacity& capacity, Carving carving = Carving::kRays) noexcept {
    return KeyIndex::required_bytes(capacity.ray_blocks) +
           arena_bytes<RayBlock>(capacity.ray_blocks) + arena_bytes<std::uint32_t>(kRecent) +
           (carving == Carving::kRays
                ? arena_bytes<std::uint32_t>(std::size_t{capacity.ray_blocks} + 1) +
                      RangeImage::required_bytes()
                : 0);
  }
  [[nodiscard]] static Result<FreeSpace> make(Arena& arena, const ScanCapacity& capacity,
                                              Carving carving = Carving::kRays) noexcept;
  FreeSpace() noexcept = default;

  /// Starts a scan seen from origin_map (metres). O(capacity).
  void begin(const FreeSpaceConfig& config, const Lattice& lattice,
             const Point3d& origin_map) noexcept;
  /// Declares the returns, so that no ray near the direction of one is carved beyond it, and marks
  /// their voxels as hit. All before the first trace. Fails with
  /// kResourceExhausted iff the ray blocks are full. O(returns).
  Status add_returns(std::span<const ScanPoint> returns) noexcept;
  /// The axis along which the ray to end_map is longest. Rays are best traced one axis after the
  /// other.
  [[nodiscard]] int axis_of(const Point3f& end_map) const noexcept;
  /// Traces the ray to end_map, which must be in the grid, up to the nearest return near its
  /// direction less the margin. is_return: end_map is a return, not the range limit. Fails with
  /// kResourceExhausted iff the ray blocks are full, with some of the voxels marked. O(voxels
  /// crossed).
  Status trace(const Point3f& end_map, bool is_return) noexcept;
  /// Without rays: RayBlock::passed of a block, its words along axis, to mark voxels in. Null iff
  /// the ray blocks are full. O(1).
  [[nodiscard]] std::uint64_t* words_of(BlockCoord coord, int axis) noexcept {
    RayBlock* const block = entry(coord);
    if (block == nullptr) return nullptr;
    if (block->words_along != axis) block->turn(axis);
    return block->passed.data();
  }
  /// Fetches the memory that words_of() reads first of a block in the grid. O(1).
  [[gnu::always_inline]] void prefetch(BlockCoord coord) const noexcept {
    index_.prefetch(pack_in_grid(coord));
  }
  /// Without rays: marks the voxels of returns as hit where there are blocks. O(returns).
  void mark_hits(std::span<const ScanPoint> returns) noexcept;
  /// Whether a return is in the voxel, if it is in a block that anything was marked in. O(1).
  [[nodiscard]] bool is_hit(const VoxelCoord& voxel) noexcept {
    const RayBlock* const block = held(block_of(voxel));
    return block != nullptr && has_row(block->hit, row_order(voxel));
  }
  /// After the last trace: all of RayBlock::passed along z. O(ray blocks).
  void finish() noexcept;
  /// Makes an entry for each block that trace could mark on the ray to a point, and for that of the
  /// point's voxel, which add_returns marks; calls visit(RayBlock&) once for each. visit returns
  /// false to stop. Marks nothing. crossed() are those visited. Fails with kResourceExhausted iff
  /// the ray blocks or their index are full, kOutOfRange iff visit stopped; entries made until then
  /// stay, see truncate(). O(blocks crossed).
  template <class Visit>
  Status cross(const ScanPoint& end, Visit&& visit) noexcept;
  /// Numbers in blocks() of those that the last cross() visited.
  [[nodiscard]] std::span<const std::uint32_t> crossed() const noexcept {
    return crossed_.first(crossed_count_);
  }
  /// Takes back the entries made last, down to count. O(entries taken back).
  void truncate(std::size_t count) noexcept;
  /// Forgets returns and marks; the entries stay, so that trace() through them cannot fail.
  /// O(capacity).
  void forget_marks() noexcept;

  [[nodiscard]] std::span<RayBlock> blocks() noexcept { return blocks_.first(count_); }
  /// Voxels stepped through by trace() since begin(), and blocks by cross().
  [[nodiscard]] std::uint64_t steps() const noexcept { return steps_; }
  /// A bound on the voxels that a ray to end_map crosses, from its length alone: |dx| + |dy| + |dz|
  /// in voxels, plus 4.
  [[nodiscard]] std::uint64_t most_steps(const Point3f& end_map) const noexcept;

 private:
  /// Numbers of the blocks last asked for, by the low bits of their coordinates.
  static constexpr std::size_t kRecent = 4096;

  void add_return(const Point3f& p_map) noexcept;
  Status mark_hit(const VoxelCoord& voxel) noexcept;
  [[nodiscard]] SlabWalk walk_to(const Point3f& end_map, double part) const noexcept {
    return {origin_map_ / resolution_m_, end_map.cast<double>() / resolution_m_, part};
  }
  [[nodiscard]] double carve_length_m(const Point3d& direction, double length_m,
                                      bool is_return) const noexcept;
  [[nodiscard]] RayBlock* entry(BlockCoord coord) noexcept {
    // Rays side by side go through the same blocks. A stale number is caught by the coordinates.
    const std::uint32_t recent = recent_[recent_slot(coord)];
    if (recent < count_ && blocks_[recent].coord == coord) return &blocks_[recent];
    return find_entry(coord);
  }
  [[nodiscard]] static std::size_t recent_slot(BlockCoord coord) noexcept {
    return static_cast<std::size_t>((coord.x & 31) | ((coord.y & 31) << 5) | ((coord.z & 3) << 10));
  }
  static void mark_hit(RayBlock& block, const VoxelCoord& voxel) noexcept;
  [[nodiscard]] RayBlock* find_entry(BlockCoord coord) noexcept;
  /// Null: there is none.
  [[nodiscard]] RayBlock* held(BlockCoord coord) noexcept;
  [[nodiscard]] RayBlock* new_entry(BlockCoord coord) noexcept;

  KeyIndex index_{};
  std::span<RayBlock> blocks_;
  std::span<std::uint32_t> recent_;
  std::span<std::uint32_t> crossed_;  ///< Numbers of the blocks that one ray crosses.
  RangeImage image_{};
  std::size_t crossed_count_ = 0;
  std::size_t count_ = 0;
  std::uint64_t steps_ = 0;
  FreeSpaceConfig config_{};
  double resolution_m_ = 1.0;
  Point3d origin_map_ = Point3d::Zero();
};

template <class Visit>
Status FreeSpace::cross(const ScanPoint& end, Visit&& visit) noexcept {
  crossed_count_ = 0;
  bool stopped = false;
  const auto add = [&](BlockCoord coord) {
    RayBlock* const block = entry(coord);
    if (block == nullptr || crossed_count_ == crossed_.size()) return false;
    crossed_[crossed_count_++] = static_cast<std::uint32_t>(block - blocks_.data());
    stopped = !visit(*block);
    return !stopped;
  };
  // The walk truncates: it ends before a border on which the end lies exactly, and the end's voxel
  // may be in the block behind that border.
  const auto add_end = [&](BlockCoord coord) {
    for (std::size_t i = crossed_count_; i > 0; --i) {
      if (blocks_[crossed_[i - 1]].coord == coord) return true;
    }
    return add(coord);
  };
  const bool all = walk_to(end.p_map, 1.0).for_blocks(add) && add_end(block_of(end.voxel));
  steps_ += crossed_count_;
  if (stopped) return Status::kOutOfRange;
  return all ? Status::kOk : Status::kResourceExhausted;
}

}  // namespace tessera
