// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/base/internal/digest.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

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

/// One row of eight voxels along x.
void add_row(const LocalMap& map, const Block& block, int y, int z, Digest& digest) noexcept {
  const BlockCoord coord = unpack(BlockKey{block.key});
  for (int x = 0; x < kBlockEdge; ++x) {
    const VoxelCoord local{x, y, z};
    const int octet = octet_in_block(local);
    const int voxel = voxel_in_octet(local);
    const bool labelled =
        ((unsigned{map.observed_labels(block, octet)} >> static_cast<unsigned>(voxel)) & 1U) != 0;
    if (!labelled && map.free_passes(block, octet, voxel) == 0) continue;
    const VoxelCoord v = voxel_at(coord, octet, voxel);
    digest.add((std::uint64_t{static_cast<std::uint32_t>(v.z)} << 32U) |
               static_cast<std::uint32_t>(v.y));
    digest.add(static_cast<std::uint32_t>(v.x));
    const VoxelEvidence evidence = map.evidence(block, octet, voxel);
    for (std::size_t l = 0; l < static_cast<std::size_t>(evidence.num_components); ++l) {
      if (evidence.sigma[l] > 0.0F) {
        digest.add(l);
        digest.add_float(evidence.sigma[l]);
      }
    }
    if (evidence.rest > 0.0F) {
      digest.add(kMaxComponents);
      digest.add_float(evidence.rest);
    }
  }
}

/// The first place from begin on, before end, where the block's key differs above shift.
std::size_t end_of_run(std::span<const KeyedIndex> blocks, std::size_t begin, std::size_t end,
                       unsigned shift) noexcept {
  std::size_t i = begin;
  while (i < end && (blocks[i].key >> shift) == (blocks[begin].key >> shift)) ++i;
  return i;
}

/// Slice z of a row of blocks along x. False iff a block cannot be had.
bool add_slice(const LocalMap& map, std::span<const KeyedIndex> row, const BlockLookup& lookup,
               int z, Digest& digest) noexcept {
  for (int y = 0; y < kBlockEdge; ++y) {
    for (const KeyedIndex& item : row) {
      const Block* const block = lookup.find(lookup.context, item);
      if (block == nullptr) return false;
      add_row(map, *block, y, z, digest);
    }
  }
  return true;
}

}  // namespace

Result<std::uint64_t> digest(const LocalMap& map, std::span<const KeyedIndex> blocks,
                             const BlockLookup& lookup) noexcept {
  Digest result;
  add_settings(map, result);
  constexpr unsigned kLayer = 42;  // z of the block
  constexpr unsigned kRow = 21;    // z and y
  for (std::size_t layer = 0; layer < blocks.size();) {
    const std::size_t layer_end = end_of_run(blocks, layer, blocks.size(), kLayer);
    for (int z = 0; z < kBlockEdge; ++z) {
      for (std::size_t row = layer; row < layer_end;) {
        const std::size_t row_end = end_of_run(blocks, row, layer_end, kRow);
        if (!add_slice(map, blocks.subspan(row, row_end - row), lookup, z, result))
          return Status::kIo;
        row = row_end;
      }
    }
    layer = layer_end;
  }
  return result.value();
}

std::uint64_t digest(const LocalMap& map, std::span<KeyedIndex> workspace) noexcept {
  const LocalMap* blocks = &map;
  const BlockLookup lookup{
      &blocks, [](void* context, const KeyedIndex& item) {
        return &(*static_cast<const LocalMap**>(context))->block_at(item.index);
      }};
  return *digest(map, map.blocks_in_order(workspace), lookup);
}

}  // namespace tessera
