// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/storage_needs.hpp"

#include "tessera/base/internal/bits.hpp"
#include "tessera/inference/internal/tile_evidence.hpp"

namespace tessera {

namespace {

/// The layers of a block that units of a tile lie in, a bit each; units: all in block number i.
unsigned layers_of_units(const Tile& tile, int unit_edge, int i, std::uint64_t units) noexcept {
  unsigned rows = 0;  // of units, in z
  for (unsigned z = 0; z < 4; ++z) rows |= ((units >> (16 * z)) & 0xffffU) != 0 ? 1U << z : 0U;
  if (unit_edge == 2) return rows;
  if (unit_edge == 1) {
    const unsigned pair = ((rows & 3U) != 0 ? 1U : 0U) | ((rows & 12U) != 0 ? 2U : 0U);
    return (tile.coord.z & 1) != 0 ? pair << 2U : pair;
  }
  const unsigned half = i >= 4 ? rows >> 2U : rows;
  return ((half & 1U) != 0 ? 3U : 0U) | ((half & 2U) != 0 ? 12U : 0U);
}

unsigned layers_with_labels(const Block* block) noexcept {
  unsigned layers = 0;
  for (std::size_t i = 0; block != nullptr && i < kBlockLayers; ++i)
    layers |= (block->labels[i] != 0 ? 1U : 0U) << i;
  return layers;
}

/// Octets that these units of a tile would take, all in one of the map's blocks, beyond those that
/// the block has.
std::uint32_t new_octets(const Tile& tile, int edge, std::uint64_t units,
                         std::uint64_t present) noexcept {
  if (edge == 2) return static_cast<std::uint32_t>(count_ones(units & ~present));  // a unit each
  std::uint32_t count = 0;
  for (; units != 0; units &= units - 1) {
    const UnitOctets octets = octets_of_unit(std::countr_zero(units), edge);
    for (const OctetPlace& place : octets.places()) {
      const int octet = locate(tile, place, edge).octet;
      count += ((present >> static_cast<unsigned>(octet)) & 1U) != 0 ? 0U : 1U;
    }
  }
  return count;
}

}  // namespace

void count_tile(const LocalMap& map, int edge, Tile& tile, std::uint64_t units,
                std::uint64_t counted, SlabPool::Counts& wanted) noexcept {
  for (int i = 0; i < blocks_of_tile(edge); ++i) {
    const std::uint64_t here = units & units_of_block(edge, i);
    const BlockCoord coord = block_of_tile(tile.coord, edge, i);
    if (here == 0 || !in_grid(coord)) continue;
    SlabHandle& handle = tile.blocks[static_cast<std::size_t>(i)];
    if (handle == 0) handle = map.find_handle(coord);
    const Block* const block = handle == 0 ? nullptr : &map.block_at(handle);
    // With units of one voxel, tiles share a block and each counts it and its pages: a bound, not
    // the number.
    const std::uint64_t before = counted & units_of_block(edge, i);
    if (before == 0 && block == nullptr) ++wanted[kBlockSlab];
    const unsigned layers = layers_of_units(tile, edge, i, here);
    unsigned new_layers = layers & ~layers_with_labels(block);
    if (new_layers != 0) new_layers &= ~layers_of_units(tile, edge, i, before);
    wanted[kLabelSlab] += static_cast<std::uint32_t>(count_ones(new_layers));
    wanted[kOctetSlab] +=
        new_octets(tile, edge, here, block == nullptr ? 0 : map.octets_of(*block, layers));
  }
}

void count_ray_block(const LocalMap& map, RayBlock& ray_block, SlabPool::Counts& wanted) noexcept {
  if (!ray_block.looked_up || ray_block.block == 0) {
    ray_block.block = map.find_handle(ray_block.coord);
    const Block* const block = ray_block.block == 0 ? nullptr : &map.block_at(ray_block.block);
    // On admission one by one nothing is marked yet: the ray may pass through every layer.
    const bool marked = ray_block.carves();
    VoxelMask carved{};
    for (std::size_t z = 0; z < carved.size(); ++z)
      carved[z] = marked ? ray_block.passed[z] & ~ray_block.hit[z] : ~std::uint64_t{0};
    ray_block.free_pages =
        static_cast<std::uint8_t>(free_pages_needed(block == nullptr ? Block{} : *block, carved));
    ray_block.looked_up = true;
  }
  if (ray_block.block == 0) ++wanted[kBlockSlab];
  wanted[kFreeSlab] += ray_block.free_pages;
}

bool open_tile(LocalMap& map, int edge, Tile& tile, std::uint64_t units) noexcept {
  for (int i = 0; i < blocks_of_tile(edge); ++i) {
    const BlockCoord coord = block_of_tile(tile.coord, edge, i);
    SlabHandle& handle = tile.blocks[static_cast<std::size_t>(i)];
    if ((units & units_of_block(edge, i)) == 0 || handle != 0 || !in_grid(coord)) continue;
    const Result<SlabHandle> block = map.open_block(coord);
    if (!block.ok()) return false;
    handle = *block;
    tile.opened |= static_cast<std::uint8_t>(1U << static_cast<unsigned>(i));
  }
  return true;
}

}  // namespace tessera
