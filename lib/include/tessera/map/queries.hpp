// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reading a map: boxes, rays, and every observed voxel in order. Nothing here allocates or changes
// the map.
#pragma once

#include <span>

#include "tessera/map/cast_ray.hpp"
#include "tessera/map/internal/block_lookup.hpp"

namespace tessera {

/// Calls visit(VoxelCoord, const VoxelEvidence&) for every voxel of a block that has evidence,
/// octet by octet. O(512 + observed voxels * C).
template <class Visit>
void for_each_observed(const LocalMap& map, const Block& block, Visit&& visit) {
  const BlockCoord coord = unpack(BlockKey{block.key});
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const unsigned labels = map.observed_labels(block, octet);
    for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
      const bool labelled = ((labels >> static_cast<unsigned>(voxel)) & 1U) != 0;
      if (!labelled && map.free_passes(block, octet, voxel) == 0) continue;
      visit(voxel_at(coord, octet, voxel), map.evidence(block, octet, voxel));
    }
  }
}

/// The same for the whole map, blocks in (z, y, x) order. workspace: at least 2 * map.block_count()
/// entries, else nothing is visited.
template <class Visit>
void for_each_observed(const LocalMap& map, std::span<KeyedIndex> workspace, Visit&& visit) {
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    for_each_observed(map, map.block_at(item.index), visit);
  }
}

namespace detail {

/// Both corners belong to the box.
template <class Coord>
[[nodiscard]] constexpr bool is_within(const Coord& v, const Coord& low,
                                       const Coord& high) noexcept {
  return v.x >= low.x && v.x <= high.x && v.y >= low.y && v.y <= high.y && v.z >= low.z &&
         v.z <= high.z;
}

constexpr void clip_to_grid(VoxelCoord& low, VoxelCoord& high) noexcept {
  const auto at_least = [](std::int32_t v) { return v < -kVoxelLimit ? -kVoxelLimit : v; };
  const auto at_most = [](std::int32_t v) { return v < kVoxelLimit ? v : kVoxelLimit - 1; };
  low = {at_least(low.x), at_least(low.y), at_least(low.z)};
  high = {at_most(high.x), at_most(high.y), at_most(high.z)};
}

}  // namespace detail

/// Calls visit(VoxelCoord, const VoxelEvidence&) for every observed voxel with low <= voxel <= high
/// on each axis, blocks in (z, y, x) order; the box may reach out of the grid. workspace as above,
/// whatever the box. O(512) for each block of the map in the box, and a look-up for each block of
/// the box or, if these are more than the map has, the sorting of the map's blocks.
template <class Visit>
void for_each_in_box(const LocalMap& map, VoxelCoord low, VoxelCoord high,
                     std::span<KeyedIndex> workspace, Visit&& visit) {
  // Whatever the box: a workspace that is too short shall not go unnoticed until a box is large.
  if (workspace.size() < 2 * map.block_count()) return;
  detail::clip_to_grid(low, high);
  if (low.x > high.x || low.y > high.y || low.z > high.z) return;
  const auto visit_block = [&](const Block& block) {
    for_each_observed(map, block, [&](const VoxelCoord& v, const VoxelEvidence& evidence) {
      if (detail::is_within(v, low, high)) visit(v, evidence);
    });
  };
  const BlockCoord first = block_of(low);
  const BlockCoord last = block_of(high);
  const auto extent = [](std::int32_t a, std::int32_t b) { return static_cast<double>(b - a) + 1; };
  const double blocks = extent(first.x, last.x) * extent(first.y, last.y) * extent(first.z, last.z);
  if (blocks > static_cast<double>(map.block_count())) {
    for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
      if (detail::is_within(unpack(BlockKey{item.key}), first, last))
        visit_block(map.block_at(item.index));
    }
    return;
  }
  for (std::int32_t z = first.z; z <= last.z; ++z) {
    for (std::int32_t y = first.y; y <= last.y; ++y) {
      for (std::int32_t x = first.x; x <= last.x; ++x) {
        const Block* const block = map.find({x, y, z});
        if (block != nullptr) visit_block(*block);
      }
    }
  }
}

/// Finds blocks for voxels that come in an order: a voxel in the block of the last one costs no
/// look-up. Of use only while nobody writes to the map.
class BlockCursor {
 public:
  /// The map must outlive the cursor.
  explicit BlockCursor(const LocalMap& map) noexcept : map_(&map) {}

  /// The voxel's block; null where there is none. voxel: anywhere.
  [[nodiscard]] const Block* at(VoxelCoord voxel) noexcept {
    // Same block: coordinates differ in their last three bits only.
    const auto differ = static_cast<std::uint32_t>(voxel.x ^ last_.x) |
                        static_cast<std::uint32_t>(voxel.y ^ last_.y) |
                        static_cast<std::uint32_t>(voxel.z ^ last_.z);
    if (differ >= static_cast<std::uint32_t>(kBlockEdge) || !known_) {
      block_ = map_->find(block_of(voxel));
      last_ = voxel;
      known_ = true;
    }
    return block_;
  }
  /// As LocalMap::query.
  [[nodiscard]] Estimate query(VoxelCoord voxel) noexcept {
    const Block* const block = at(voxel);
    return block == nullptr ? map_->query(voxel) : map_->query(*block, voxel);
  }
  [[nodiscard]] Estimate query(const Point3f& p_map) noexcept {
    const Result<VoxelCoord> voxel = map_->lattice().voxel_of(p_map);
    return voxel.ok() ? query(*voxel) : map_->query(p_map);
  }
  /// LocalMap::query(voxel).state.
  [[nodiscard]] VoxelState state(VoxelCoord voxel) noexcept {
    const Block* const block = at(voxel);
    return block == nullptr ? VoxelState::kUnknown : map_->state(*block, voxel);
  }

 private:
  const LocalMap* map_;
  VoxelCoord last_{};
  const Block* block_ = nullptr;
  bool known_ = false;
};

/// The map's content in 64 bits: resolution, class table, prior, tuple policy, and every observed
/// voxel's evidence. Each block is hashed on its own, a sum over its counts; these are joined in
/// (z, y, x) order of blocks. Capacity, history and revisions do not count. workspace as above; one
/// that is too short gives the digest of a map without voxels. O(512 blocks + counts).
[[nodiscard]] std::uint64_t digest(const LocalMap& map, std::span<KeyedIndex> workspace) noexcept;

/// The same for blocks that a lookup gives; blocks: their keys in ascending order. Each block is
/// asked for once, in order. Fails with kIo iff one cannot be had.
[[nodiscard]] Result<std::uint64_t> digest(const LocalMap& map, std::span<const KeyedIndex> blocks,
                                           const BlockLookup& lookup) noexcept;

}  // namespace tessera
