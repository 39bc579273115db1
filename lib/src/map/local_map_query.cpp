// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "tessera/map/local_map.hpp"

namespace tessera {

namespace {

void prefetch(const void* address) noexcept { __builtin_prefetch(address); }

/// No voxel of the grid.
constexpr VoxelCoord kNowhere{kVoxelLimit, 0, 0};

}  // namespace

Estimate LocalMap::query(const Point3f& p_map) const noexcept {
  const Result<VoxelCoord> voxel = lattice().voxel_of(p_map);
  return voxel.ok() ? query(*voxel) : unobserved_;
}

Estimate LocalMap::query(VoxelCoord voxel) const noexcept {
  if (!in_grid(voxel)) return unobserved_;
  const SlabHandle handle = find_handle(pack_in_grid(block_of(voxel)));
  return handle == 0 ? unobserved_ : query(block_at(handle), voxel);
}

Estimate LocalMap::query(const Block& block, VoxelCoord voxel) const noexcept {
  CountSummary counts(num_components(), static_cast<float>(free_passes(block, row_order(voxel))) *
                                            config_.free_weight);
  const SlabHandle tuples = octet_handle(block, octet_in_block(voxel));
  if (tuples != 0) tuples_.summarize(pool_.at(tuples), voxel_in_octet(voxel), counts);
  return counts.estimate(config_.prior);
}

/// A voxel on its way through a group: each step reads what the step before has sent for.
struct LocalMap::Ask {
  VoxelCoord voxel;
  bool inside = false;     ///< The grid.
  bool as_before = false;  ///< In the block of the one before.
  BlockKey key;
  const Block* block = nullptr;
  SlabHandle labels = 0;

  void send_for_bucket(const LocalMap& map, const Ask* before) noexcept {
    inside = in_grid(voxel);
    if (!inside) return;
    key = pack_in_grid(block_of(voxel));
    as_before = before != nullptr && before->inside && key == before->key;
    if (!as_before) map.index_.prefetch(key);
  }
  void send_for_block(const LocalMap& map) noexcept {
    if (as_before || !inside) return;
    // Whose hash agrees is nearly always the one: its key, which the next step looks at, is awaited
    // there.
    const SlabHandle likely = map.index_.find(key, [](SlabHandle) { return true; });
    if (likely == 0) return;
    block = &map.block_at(likely);
    prefetch(block);
  }
  void send_for_pages(const LocalMap& map, const Ask* before) noexcept {
    if (before != nullptr && as_before) {
      block = before->block;
    } else if (block != nullptr && block->key != key.bits) {
      const SlabHandle handle = map.find_handle(key);
      block = handle == 0 ? nullptr : &map.block_at(handle);
    }
    if (block == nullptr) return;
    const int row = row_order(voxel);
    labels = block->labels[layer_of_row(row)];
    const SlabHandle passes = block->free_passes[layer_of_row(row)];
    if (labels != 0)
      prefetch(map.pool_.at(labels) + octet_in_layer(octet_in_block(voxel)) * sizeof(SlabHandle));
    if (passes != 0) prefetch(map.pool_.at(passes) + row_in_layer(row));
  }
  void send_for_tuples(const LocalMap& map) const noexcept {
    if (labels == 0) return;
    const SlabHandle tuples = map.octet_handle(*block, octet_in_block(voxel));
    if (tuples != 0) map.tuples_.prefetch(map.pool_.at(tuples));
  }
};

void LocalMap::query_group(std::span<Ask> asks, Estimate* into) const noexcept {
  const Ask* before = nullptr;
  for (Ask& ask : asks) {
    ask.send_for_bucket(*this, before);
    before = &ask;
  }
  for (Ask& ask : asks) ask.send_for_block(*this);
  before = nullptr;
  for (Ask& ask : asks) {
    ask.send_for_pages(*this, before);
    before = &ask;
  }
  for (const Ask& ask : asks) ask.send_for_tuples(*this);
  for (const Ask& ask : asks)
    *into++ = ask.block == nullptr ? unobserved_ : query(*ask.block, ask.voxel);
}

template <class Item, class VoxelOf>
void LocalMap::query_in_groups(std::span<const Item> items, std::span<Estimate> into,
                               VoxelOf&& voxel_of) const noexcept {
  for (std::size_t at = 0; at < items.size(); at += kQueryGroup) {
    const std::size_t n = items.size() - at < kQueryGroup ? items.size() - at : kQueryGroup;
    std::array<Ask, kQueryGroup> asks;
    for (std::size_t i = 0; i < n; ++i) asks[i].voxel = voxel_of(items[at + i]);
    query_group(std::span<Ask>(asks).first(n), &into[at]);
  }
}

Status LocalMap::query(std::span<const VoxelCoord> voxels,
                       std::span<Estimate> into) const noexcept {
  if (voxels.size() != into.size()) return Status::kInvalidArgument;
  query_in_groups(voxels, into, [](const VoxelCoord& voxel) { return voxel; });
  return Status::kOk;
}

Status LocalMap::query(std::span<const Point3f> points_map,
                       std::span<Estimate> into) const noexcept {
  if (points_map.size() != into.size()) return Status::kInvalidArgument;
  const Lattice grid = lattice();
  query_in_groups(points_map, into, [&](const Point3f& p_map) {
    const Result<VoxelCoord> voxel = grid.voxel_of(p_map);
    return voxel.ok() ? *voxel : kNowhere;
  });
  return Status::kOk;
}

}  // namespace tessera
