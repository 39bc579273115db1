// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a map is made with. Fixed for its life, stored in its file, and enough to compute its memory
// at compile time.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "tessera/base/arena.hpp"
#include "tessera/grid/internal/block_index.hpp"
#include "tessera/grid/internal/slab_pool.hpp"
#include "tessera/map/internal/label_votes.hpp"
#include "tessera/semantics/internal/tuple_store.hpp"
#include "tessera/semantics/reading.hpp"

namespace tessera {

struct MapConfig {
  /// What 32-bit handles reach, and less than all addresses.
  static constexpr std::size_t kMaxStorageBytes =
      (std::numeric_limits<std::size_t>::max() / SlabPool::kPageBytes <
               (std::uint64_t{1} << 36U) / SlabPool::kPageBytes
           ? std::numeric_limits<std::size_t>::max() / SlabPool::kPageBytes - 1
           : (std::uint64_t{1} << 36U) / SlabPool::kPageBytes - 1) *
      SlabPool::kPageBytes;

  double resolution_m = 0.1;  ///< Edge of a voxel, 0.001 to 1e6.
  double prior = 0.001;       ///< sigma_0 of every component, added on read; 0 to 1e6.
  /// Cap of a voxel's total evidence. Labels over it scale all components down; a free pass over it
  /// scales the labels down. 0: no cap; else free_weight to 255 free_weight, and at most 1e6.
  float max_evidence = 100.0F;
  /// Free evidence of one pass, > 0 and at most 1e6. A voxel counts at most 255 passes.
  float free_weight = 0.4F;
  /// kDense is exact, at a float for each class and voxel.
  TuplePolicy tuple = TuplePolicy::kCompact;
  /// What its probabilities are of. No count and no digest depends on it.
  Probabilities probabilities = Probabilities::kEffective;
  /// Keeps beside the labels what points said of each class, which InferenceMode::kLattice needs:
  /// 48 bytes a layer with labels, which files and archives have too. What is loaded without them
  /// votes as its labels. What probabilities are of depends on it (Reading::around).
  bool label_votes = false;
  /// Bytes for blocks, tuples and the free layer together, in use or not; at least four pages of
  /// 4 KiB, and at most kMaxStorageBytes.
  std::size_t storage_bytes = std::size_t{384} << 20U;
  /// Of the hash of block keys. To be set at random where keys come from others, who could choose
  /// them to collide. Not kept in files; contents and digests do not depend on it.
  std::uint64_t hash_seed = 0;
};

/// How far a quotient of two decimal settings may be off a whole number of passes: 25 / 0.1 is 250,
/// not 249.
inline constexpr float kPassRounding = 1e-4F;

/// Free passes that a voxel counts at the cap, which is over 0: at most 255. O(1).
constexpr std::uint8_t passes_at_cap(float max_evidence, float free_weight) noexcept {
  const float passes = max_evidence / free_weight + kPassRounding;
  return passes >= 255.0F ? std::uint8_t{255} : static_cast<std::uint8_t>(passes);
}

/// True iff every setting but storage_bytes is in its range. O(1).
constexpr bool in_range(const MapConfig& config) noexcept {
  constexpr double kLargest = 1e6;  // beyond it float coordinates and counts mean nothing
  const double w_free = static_cast<double>(config.free_weight);
  const bool passes = config.max_evidence >= config.free_weight &&
                      config.max_evidence <= (255.0F + kPassRounding) * config.free_weight;
  return config.resolution_m >= 1e-3 && config.resolution_m <= kLargest && config.prior >= 0.0 &&
         config.prior <= kLargest && w_free > 0.0 && w_free <= kLargest &&
         config.max_evidence >= 0.0F && config.max_evidence <= 1e6F &&
         (config.max_evidence == 0.0F || passes) && config.tuple <= TuplePolicy::kCompact;
}

/// Label evidence of a voxel that one robot may add to a global map where its maps have no cap.
inline constexpr float kEvidenceWithoutCap = 250.0F;

/// The most that one robot's evidence counts in a voxel of the global map, of robots whose local
/// maps are so: that of their maps, or 250 where these have no cap.
[[nodiscard]] constexpr float robot_max_evidence(const MapConfig& map) noexcept {
  return map.max_evidence > 0.0F ? map.max_evidence : kEvidenceWithoutCap;
}

/// A block is kept in layers, two voxels high: sixteen octets each. What lies in a block is mostly
/// flat.
inline constexpr int kBlockLayers = kBlockEdge / 2;
inline constexpr int kLayerOctets = kBlockOctets / kBlockLayers;
inline constexpr int kLayerVoxels = kBlockVoxels / kBlockLayers;
/// All layers of a block, a bit each.
inline constexpr unsigned kAllLayers = (1U << static_cast<unsigned>(kBlockLayers)) - 1U;

/// A block: 8 x 8 x 8 voxels. It holds label evidence, free evidence, or both.
struct Block {
  using Layers = std::array<SlabHandle, kBlockLayers>;

  std::uint64_t key = 0;
  /// For those who read while the map is written (MapReader): odd while the block is changed or not
  /// the map's, zero before it is; else a number that no other state of any block has had.
  std::uint64_t stamp = 0;
  std::uint32_t revision = 0;      ///< The map's revision when the block's content last changed.
  std::uint32_t label_voxels = 0;  ///< Voxels with evidence in 1 .. C + 1.
  Layers labels{};                 ///< LabelPage of each layer, or none.
  Layers free_passes{};            ///< FreePage of each layer, or none.
  /// Neighbours in the list of blocks that may hold what moves; not for other threads.
  SlabHandle moving_before = 0;
  SlabHandle moving_next = 0;

  [[nodiscard]] bool has_labels() const noexcept { return any(labels); }
  [[nodiscard]] bool has_free_passes() const noexcept { return any(free_passes); }

 private:
  static constexpr bool any(const Layers& pages) noexcept {
    return (pages[0] | pages[1] | pages[2] | pages[3]) != 0;
  }
};
static_assert(sizeof(Block) == 64);

/// Where the tuples of a layer's octets are, and which voxels of an octet have label evidence.
struct LabelPage {
  std::array<SlabHandle, kLayerOctets> octets{};
  std::array<std::uint8_t, kLayerOctets> observed{};
};
static_assert(sizeof(LabelPage) == 80);

/// A label page's bytes; with votes (LabelVotes) they follow it.
[[nodiscard]] constexpr std::uint32_t label_page_bytes(bool with_votes) noexcept {
  return static_cast<std::uint32_t>(sizeof(LabelPage) + (with_votes ? sizeof(LabelVotes) : 0));
}

/// Passes of rays through each voxel of a layer, x fastest, then y, then z.
struct FreePage {
  std::array<std::uint8_t, kLayerVoxels> passes{};
};

/// The layer of an octet or of a voxel in row order, and the place in that layer.
constexpr std::size_t layer_of_octet(int octet) noexcept {
  return static_cast<std::size_t>(octet) / kLayerOctets;
}
constexpr std::size_t octet_in_layer(int octet) noexcept {
  return static_cast<std::size_t>(octet) % kLayerOctets;
}
constexpr std::size_t layer_of_row(int row_order) noexcept {
  return static_cast<std::size_t>(row_order) / kLayerVoxels;
}
constexpr std::size_t row_in_layer(int row_order) noexcept {
  return static_cast<std::size_t>(row_order) % kLayerVoxels;
}

/// Bits of a block's 512 voxels: bit y * 8 + x of word z.
using VoxelMask = std::array<std::uint64_t, kBlockEdge>;

/// True iff the voxel at this row order is in the mask.
constexpr bool has_row(const VoxelMask& mask, int row_order) noexcept {
  return ((mask[static_cast<std::size_t>(row_order >> 6)] >> (row_order & 63)) & 1U) != 0;
}
/// The voxels of a block that are in a box, first to last on each axis. O(kBlockEdge).
constexpr VoxelMask voxels_within(const BlockCoord& block, const VoxelCoord& first,
                                  const VoxelCoord& last) noexcept {
  const VoxelCoord corner = voxel_at(block, 0, 0);
  const auto along = [](std::int32_t from, std::int32_t low, std::int32_t high) {
    std::uint64_t bits = 0;
    for (std::int32_t i = 0; i < kBlockEdge; ++i)
      bits |= std::uint64_t{from + i >= low && from + i <= high ? 1U : 0U} << i;
    return bits;
  };
  const std::uint64_t x = along(corner.x, first.x, last.x);
  const std::uint64_t y = along(corner.y, first.y, last.y);
  const std::uint64_t z = along(corner.z, first.z, last.z);
  std::uint64_t slice = 0;
  for (unsigned i = 0; i < kBlockEdge; ++i) slice |= ((y >> i) & 1U) != 0 ? x << (8 * i) : 0U;
  VoxelMask mask{};
  for (unsigned i = 0; i < kBlockEdge; ++i) mask[i] = ((z >> i) & 1U) != 0 ? slice : 0U;
  return mask;
}
/// Adds the voxel at this row order.
constexpr void add_row(VoxelMask& mask, int row_order) noexcept {
  mask[static_cast<std::size_t>(row_order >> 6)] |= std::uint64_t{1} << (row_order & 63);
}
/// Takes the voxel at this row order out.
constexpr void take_row(VoxelMask& mask, int row_order) noexcept {
  mask[static_cast<std::size_t>(row_order >> 6)] &= ~(std::uint64_t{1} << (row_order & 63));
}
/// True iff any voxel is in the mask.
constexpr bool any_row(const VoxelMask& mask) noexcept {
  std::uint64_t any = 0;
  for (const std::uint64_t slice : mask) any |= slice;
  return any != 0;
}
/// Calls visit(row order) for each voxel in the mask, in ascending order.
template <class Visit>
constexpr void for_rows(const VoxelMask& mask, Visit&& visit) noexcept {
  for (int z = 0; z < kBlockEdge; ++z)
    for (std::uint64_t left = mask[static_cast<std::size_t>(z)]; left != 0; left &= left - 1)
      visit(64 * z + std::countr_zero(left));
}

/// What a scan's see-through did to a block's labels.
struct Contradicted {
  std::uint32_t doubted = 0;  ///< Voxels whose labels were reduced.
  std::uint32_t cleared = 0;  ///< Those that are free now.
};

/// The free pages that a pass through the voxels of mask takes beyond those that the block has.
constexpr std::uint32_t free_pages_needed(const Block& block, const VoxelMask& mask) noexcept {
  std::uint32_t count = 0;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const bool passed = (mask[2 * layer] | mask[2 * layer + 1]) != 0;
    count += passed && block.free_passes[layer] == 0 ? 1U : 0U;
  }
  return count;
}

/// Sizes that a map's slab pool serves.
enum SlabSize : int { kBlockSlab = 0, kLabelSlab = 1, kFreeSlab = 2, kOctetSlab = 3 };

/// The most blocks that storage can hold, each with the least a block needs: itself and a free
/// page, or a label page and an octet of the smallest tuples.
constexpr std::size_t max_blocks(const MapConfig& config) noexcept {
  constexpr std::size_t kLeastOctet = TupleStore::octet_bytes(TuplePolicy::kDense, 3);  // one class
  constexpr std::size_t kLeastLabels = sizeof(LabelPage) + kLeastOctet;
  constexpr std::size_t kLeast = sizeof(FreePage) < kLeastLabels ? sizeof(FreePage) : kLeastLabels;
  return config.storage_bytes / (sizeof(Block) + kLeast) + 1;
}

/// Bytes of arena that LocalMap::make takes for this configuration: the index, and the storage in
/// whole pages.
constexpr std::size_t required_bytes(const MapConfig& config) noexcept {
  return BlockIndex::required_bytes(max_blocks(config)) +
         config.storage_bytes / SlabPool::kPageBytes * SlabPool::kPageBytes;
}

/// The largest configuration whose required_bytes is at most budget_bytes; storage_bytes is 0 if
/// none is.
constexpr MapConfig fit_to_budget(MapConfig config, std::size_t budget_bytes) noexcept {
  config.storage_bytes = budget_bytes / SlabPool::kPageBytes * SlabPool::kPageBytes;
  while (config.storage_bytes > 0 && required_bytes(config) > budget_bytes) {
    const std::size_t excess = required_bytes(config) - budget_bytes;
    const std::size_t step = align_up(excess, SlabPool::kPageBytes);
    config.storage_bytes -= step < config.storage_bytes ? step : config.storage_bytes;
  }
  // A step down frees index memory too, so it may have gone a little too far.
  for (MapConfig larger = config; config.storage_bytes > 0; config = larger) {
    larger.storage_bytes += SlabPool::kPageBytes;
    if (required_bytes(larger) > budget_bytes) break;
  }
  return config;
}

}  // namespace tessera
