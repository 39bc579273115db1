// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/map_summary.hpp"

#include <algorithm>

#include "tessera/base/internal/digest.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

// --- Digest --------------------------------------------------------------------------------------

void add_settings(const LocalMap& map, Digest& digest) noexcept {
  digest.add(std::bit_cast<std::uint64_t>(map.config().resolution_m));
  digest.add(std::bit_cast<std::uint64_t>(map.config().prior));
  digest.add(static_cast<std::uint64_t>(map.config().tuple));
  digest.add(static_cast<std::uint64_t>(map.classes().num_classes()));
  for (int label = 1; label <= map.classes().num_classes(); ++label) {
    const SemanticClass& c = map.classes()[label];
    for (const char letter : c.name) digest.add(static_cast<unsigned char>(letter));
    digest.add((std::uint64_t{c.color.r} << 16U) | (std::uint64_t{c.color.g} << 8U) | c.color.b);
  }
}

constexpr unsigned kRest = kMaxComponents;  ///< The rest's component.
constexpr unsigned kCentroid = kRest + 1;   ///< The centroid's, whose code counts.

/// A count: the row order of its voxel, its component and its bits, no two of a block alike.
std::uint64_t hash_of(int row, unsigned component, float count) noexcept {
  constexpr std::uint64_t kSalt = 0x9e3779b97f4a7c15U;
  const std::uint64_t place =
      (std::uint64_t{static_cast<unsigned>(row)} << 40U) | (std::uint64_t{component} << 32U);
  return mix64((place | std::bit_cast<std::uint32_t>(count)) + kSalt);
}

/// The sum of the hashes of all its counts, so that their order in memory does not matter; 0 where
/// nothing was observed.
std::uint64_t hash_of(const LocalMap& map, const Block& block) noexcept {
  std::uint64_t sum = 0;
  for (std::uint64_t octets = map.octets_of(block); octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    const OctetCentroids centroids = map.centroids(block, octet);
    for (unsigned voxels = map.observed_labels(block, octet); voxels != 0; voxels &= voxels - 1) {
      const int voxel = std::countr_zero(voxels);
      const int row = row_order(octet, voxel);
      const Centroid centroid = centroids[static_cast<std::size_t>(voxel)];
      if (centroid.known()) sum += hash_of(row, kCentroid, static_cast<float>(centroid.code()));
      map.visit_labels(
          block, octet, voxel,
          [&](int component, float count) {
            sum += hash_of(row, static_cast<unsigned>(component), count);
          },
          [&](float count) { sum += hash_of(row, kRest, count); });
    }
  }
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    if (block.free_passes[layer] == 0) continue;
    const int first = static_cast<int>(layer * kLayerVoxels);
    for (int row = first; row < first + static_cast<int>(kLayerVoxels); ++row) {
      const std::uint8_t passes = map.free_passes(block, row);
      if (passes == 0) continue;
      sum += hash_of(row, 0, static_cast<float>(passes) * map.config().free_weight);
    }
  }
  return sum;
}

void add_block(const LocalMap& map, const Block& block, Digest& digest) noexcept {
  const std::uint64_t content = hash_of(map, block);
  if (content == 0) return;
  digest.add(block.key);
  digest.add(content);
}

// --- Counts --------------------------------------------------------------------------------------

void count_voxel(const LocalMap& map, const Block& block, VoxelCoord voxel, bool has_labels,
                 MapSummary& summary) noexcept {
  if (summary.observed() == 0) summary.low = summary.high = voxel;
  summary.low = {std::min(summary.low.x, voxel.x), std::min(summary.low.y, voxel.y),
                 std::min(summary.low.z, voxel.z)};
  summary.high = {std::max(summary.high.x, voxel.x), std::max(summary.high.y, voxel.y),
                  std::max(summary.high.z, voxel.z)};
  ++(has_labels ? summary.label_voxels : summary.free_voxels);
  if (!has_labels && map.state(block, voxel) != VoxelState::kOccupied) {
    ++summary.free;
    return;
  }
  const Estimate e = map.query(block, voxel);
  if (e.state != VoxelState::kOccupied) {
    ++summary.free;
    return;
  }
  ++summary.occupied;
  ++summary.occupied_by_label[static_cast<std::size_t>(e.label)];
}

unsigned with_passes(const LocalMap& map, const Block& block, int octet) noexcept {
  if (block.free_passes[layer_of_octet(octet)] == 0) return 0;
  unsigned voxels = 0;
  for (int voxel = 0; voxel < kOctetVoxels; ++voxel)
    voxels |= (map.free_passes(block, octet, voxel) != 0 ? 1U : 0U) << static_cast<unsigned>(voxel);
  return voxels;
}

void count_block(const LocalMap& map, const Block& block, MapSummary& summary) noexcept {
  const BlockCoord coord = unpack(BlockKey{block.key});
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const unsigned labels = map.observed_labels(block, octet);
    for (unsigned voxels = labels | with_passes(map, block, octet); voxels != 0;
         voxels &= voxels - 1) {
      const int voxel = std::countr_zero(voxels);
      count_voxel(map, block, voxel_at(coord, octet, voxel),
                  ((labels >> static_cast<unsigned>(voxel)) & 1U) != 0, summary);
    }
  }
}

/// Calls use(block) for each. False iff one cannot be had.
template <class Use>
bool for_each_of(std::span<const KeyedIndex> blocks, const BlockLookup& lookup, Use&& use) {
  return std::all_of(blocks.begin(), blocks.end(), [&](const KeyedIndex& item) {
    const Block* const block = lookup.find(lookup.context, item);
    if (block != nullptr) use(*block);
    return block != nullptr;
  });
}

}  // namespace

Result<std::uint64_t> digest(const LocalMap& map, std::span<const KeyedIndex> blocks,
                             const BlockLookup& lookup) noexcept {
  Digest result;
  add_settings(map, result);
  if (!for_each_of(blocks, lookup, [&](const Block& block) { add_block(map, block, result); }))
    return Status::kIo;
  return result.value();
}

std::uint64_t digest(const LocalMap& map, std::span<KeyedIndex> workspace) noexcept {
  return *digest(map, map.blocks_in_order(workspace), BlocksInMemory(map).lookup());
}

Result<MapSummary> summarize(const LocalMap& map, std::span<const KeyedIndex> blocks,
                             const BlockLookup& lookup) noexcept {
  MapSummary summary;
  Digest result;
  add_settings(map, result);
  const bool all = for_each_of(blocks, lookup, [&](const Block& block) {
    add_block(map, block, result);
    count_block(map, block, summary);
  });
  if (!all) return Status::kIo;
  summary.digest = result.value();
  return summary;
}

MapSummary summarize(const LocalMap& map, std::span<KeyedIndex> workspace) noexcept {
  return *summarize(map, map.blocks_in_order(workspace), BlocksInMemory(map).lookup());
}

}  // namespace tessera
