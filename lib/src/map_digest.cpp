// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/base/digest.hpp"
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

}  // namespace

Result<std::uint64_t> digest(const LocalMap& map, std::span<const KeyedIndex> blocks,
                             const BlockLookup& lookup) noexcept {
  Digest result;
  add_settings(map, result);
  const auto same = [&](std::size_t a, std::size_t b, unsigned shift) {
    return (blocks[a].key >> shift) == (blocks[b].key >> shift);
  };
  constexpr unsigned kLayer = 42;  // z of the block
  constexpr unsigned kRow = 21;    // z and y
  for (std::size_t layer = 0; layer < blocks.size();) {
    std::size_t layer_end = layer;
    while (layer_end < blocks.size() && same(layer, layer_end, kLayer)) ++layer_end;
    for (int z = 0; z < kBlockEdge; ++z) {
      for (std::size_t row = layer; row < layer_end;) {
        std::size_t row_end = row;
        while (row_end < layer_end && same(row, row_end, kRow)) ++row_end;
        for (int y = 0; y < kBlockEdge; ++y) {
          for (std::size_t i = row; i < row_end; ++i) {
            const Block* const block = lookup.find(lookup.context, blocks[i]);
            if (block == nullptr) return Status::kIo;
            add_row(map, *block, y, z, result);
          }
        }
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
