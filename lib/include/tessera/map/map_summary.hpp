// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a map holds, counted over its voxels, with the digest of its content. Map files have it in
// their header, so that nobody reads all voxels to know it.
#pragma once

#include <array>
#include <span>

#include "tessera/map/internal/block_lookup.hpp"

namespace tessera {

struct MapSummary {
  std::uint64_t digest = 0;        ///< As digest() of queries.hpp.
  std::uint64_t label_voxels = 0;  ///< With label evidence.
  std::uint64_t free_voxels = 0;   ///< With free evidence alone.
  std::uint64_t occupied = 0;      ///< Of these two: in state occupied, and not.
  std::uint64_t free = 0;
  VoxelCoord low{};   ///< The least x, y and z of them; as high if there are none.
  VoxelCoord high{};  ///< The greatest.
  /// Occupied voxels by their most probable label.
  std::array<std::uint64_t, kMaxComponents> occupied_by_label{};
  [[nodiscard]] std::uint64_t observed() const noexcept { return label_voxels + free_voxels; }
  friend bool operator==(const MapSummary&, const MapSummary&) = default;
};

/// workspace: at least 2 * map.block_count() entries; one that is too short gives the summary of a
/// map without voxels. O(blocks + observed voxels * C).
[[nodiscard]] MapSummary summarize(const LocalMap& map, std::span<KeyedIndex> workspace) noexcept;

/// The same for blocks that a lookup gives; blocks: their keys in ascending order. Each block is
/// asked for once, in order. Fails with kIo iff one cannot be had.
[[nodiscard]] Result<MapSummary> summarize(const LocalMap& map, std::span<const KeyedIndex> blocks,
                                           const BlockLookup& lookup) noexcept;

}  // namespace tessera
