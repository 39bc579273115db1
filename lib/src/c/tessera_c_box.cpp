// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: boxes, in pieces of the caller's size.
#include "tessera/map/queries.hpp"
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

namespace {

constexpr std::uint32_t kMostLookUps = 4096;

VoxelCoord coord_of(const std::int32_t* v) noexcept { return {v[0], v[1], v[2]}; }

/// Voxels of one box into the caller's array.
class BoxWalk {
 public:
  BoxWalk(const LocalMap& map, tessera_box_cursor& cursor, std::span<tessera_voxel> into) noexcept
      : map_(map),
        cursor_(cursor),
        low_(coord_of(cursor.low)),
        high_(coord_of(cursor.high)),
        into_(into) {}

  std::uint32_t run() noexcept {
    for (std::uint32_t n = 0; n < kMostLookUps && cursor_.done == 0 && !full_; ++n)
      cursor_.by_index != 0 ? visit_bucket() : visit_next();
    return count_;
  }
  /// Whether the cursor is where a walk can be.
  [[nodiscard]] bool is_valid() const noexcept {
    const BlockCoord block{cursor_.block[0], cursor_.block[1], cursor_.block[2]};
    return cursor_.next < BlockIndex::kBucketSlots * kBlockVoxels && in_grid(low_) &&
           in_grid(high_) &&
           (cursor_.done != 0 || cursor_.by_index != 0 ||
            detail::is_within(block, block_of(low_), block_of(high_)));
  }

 private:
  /// From the voxel first on; true iff all of the block was given.
  bool give(const Block& block, std::uint32_t first) noexcept {
    const BlockCoord coord = unpack(BlockKey{block.key});
    for (std::uint32_t i = first; i < kBlockVoxels; ++i) {
      const int octet = static_cast<int>(i) / kOctetVoxels;
      const int place = static_cast<int>(i) % kOctetVoxels;
      const unsigned labels = map_.observed_labels(block, octet);
      const bool labelled = ((labels >> static_cast<unsigned>(place)) & 1U) != 0;
      if (!labelled && map_.free_passes(block, octet, place) == 0) continue;
      const VoxelCoord voxel = voxel_at(coord, octet, place);
      if (!detail::is_within(voxel, low_, high_)) continue;
      if (count_ == into_.size()) {
        stopped_at_ = i;
        full_ = true;
        return false;
      }
      into_[count_++] = {.x = voxel.x,
                         .y = voxel.y,
                         .z = voxel.z,
                         .reserved = 0,
                         .estimate = estimate_of(map_.query(block, voxel))};
    }
    return true;
  }
  void visit_next() noexcept {
    const BlockCoord at{cursor_.block[0], cursor_.block[1], cursor_.block[2]};
    const Block* const block = map_.find(at);
    if (block != nullptr && !give(*block, cursor_.next)) {
      cursor_.next = stopped_at_;
      return;
    }
    cursor_.next = 0;
    const BlockCoord first = block_of(low_);
    const BlockCoord last = block_of(high_);
    if (++cursor_.block[0] <= last.x) return;
    cursor_.block[0] = first.x;
    if (++cursor_.block[1] <= last.y) return;
    cursor_.block[1] = first.y;
    if (++cursor_.block[2] <= last.z) return;
    cursor_.done = 1;
  }
  /// The blocks of one bucket of the index; the cursor says which of them comes next.
  void visit_bucket() noexcept {
    SweepCursor sweep{cursor_.place};
    if (std::size_t{cursor_.place} * BlockIndex::kBucketSlots >= map_.index().slots()) {
      cursor_.done = 1;
      return;
    }
    std::uint32_t number = 0;
    map_.visit_blocks(sweep, 1, [&](BlockKey, SlabHandle handle) {
      const std::uint32_t first = kBlockVoxels * number;
      ++number;
      if (full_ || cursor_.next >= first + kBlockVoxels) return true;
      const std::uint32_t from = cursor_.next > first ? cursor_.next - first : 0;
      if (!give(map_.block_at(handle), from)) cursor_.next = first + stopped_at_;
      return true;
    });
    if (full_) return;
    cursor_.next = 0;
    ++cursor_.place;
  }

  const LocalMap& map_;
  tessera_box_cursor& cursor_;
  VoxelCoord low_;
  VoxelCoord high_;
  std::span<tessera_voxel> into_;
  std::uint32_t count_ = 0;
  std::uint32_t stopped_at_ = 0;
  bool full_ = false;
};

/// A voxel of the grid, for a coordinate that is a number.
std::int32_t voxel_on_axis(float p, double resolution_m) noexcept {
  constexpr double kLimit = kVoxelLimit;
  const double q = static_cast<double>(p) / resolution_m;
  if (q < -kLimit) return -kVoxelLimit;
  return q < kLimit ? floor_to_int(q) : kVoxelLimit - 1;
}

}  // namespace

extern "C" {

tessera_status tessera_box_begin(const tessera_robot* robot, uint32_t map, const float* low,
                                 const float* high, tessera_box_cursor* cursor) {
  if (!is_robot(robot) || !is_map(map) || low == nullptr || high == nullptr || cursor == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  const LocalMap& of = map_of(*robot, map);
  tessera_box_cursor begun{};
  begun.map = map;
  double blocks = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Written so that NaN fails.
    if (!(low[axis] <= high[axis])) return TESSERA_INVALID_ARGUMENT;
    begun.low[axis] = voxel_on_axis(low[axis], of.lattice().resolution_m());
    begun.high[axis] = voxel_on_axis(high[axis], of.lattice().resolution_m());
  }
  const BlockCoord first = block_of(coord_of(begun.low));
  const BlockCoord last = block_of(coord_of(begun.high));
  for (const std::int32_t edge : {last.x - first.x, last.y - first.y, last.z - first.z})
    blocks *= edge + 1.0;
  begun.by_index = blocks > static_cast<double>(of.block_count()) ? 1U : 0U;
  begun.block[0] = first.x;
  begun.block[1] = first.y;
  begun.block[2] = first.z;
  *cursor = begun;
  return TESSERA_OK;
}

tessera_status tessera_box_next(const tessera_robot* robot, tessera_box_cursor* cursor,
                                tessera_voxel* voxels, uint32_t capacity, uint32_t* count) {
  if (!is_robot(robot) || cursor == nullptr || !is_map(cursor->map) || voxels == nullptr ||
      capacity == 0 || count == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*robot, cursor->map)) return TESSERA_BUSY;
  BoxWalk walk(map_of(*robot, cursor->map), *cursor, {voxels, capacity});
  if (!walk.is_valid()) return TESSERA_INVALID_ARGUMENT;
  *count = walk.run();
  return TESSERA_OK;
}

}  // extern "C"
