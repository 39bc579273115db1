// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "laws/map_content.hpp"

#include <algorithm>
#include <bit>

namespace tessera::oracle {

namespace {

LabelCounts counts_of(const LocalMap& map, const Block& block, int octet, int voxel) {
  LabelCounts counts;
  counts.place = octet * kOctetVoxels + voxel;
  map.visit_labels(
      block, octet, voxel,
      [&](int component, float count) {
        counts.bits[static_cast<std::size_t>(component - 1)] = std::bit_cast<std::uint32_t>(count);
      },
      [&](float rest) { counts.bits.back() = std::bit_cast<std::uint32_t>(rest); });
  return counts;
}

}  // namespace

MapContent content_of(const LocalMap& map) {
  MapContent content;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
    const Block& block = map.block_at(item.index);
    BlockEvidenceCopy copy;
    copy.at = unpack(BlockKey{item.key});
    const bool passed = copy_passes(map, block, copy.passes);
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      unsigned observed = map.observed_labels(block, octet);
      for (; observed != 0; observed &= observed - 1)
        copy.labels.push_back(counts_of(map, block, octet, std::countr_zero(observed)));
    }
    if (passed || !copy.labels.empty()) content.push_back(std::move(copy));
  }
  return content;
}

const BlockEvidenceCopy* find_block(const MapContent& content, BlockCoord at) {
  const BlockKey key = pack_in_grid(at);
  const auto found = std::lower_bound(
      content.begin(), content.end(), key,
      [](const BlockEvidenceCopy& block, BlockKey k) { return pack_in_grid(block.at) < k; });
  return found != content.end() && found->at == at ? &*found : nullptr;
}

void add_to(Digest& digest, const MapContent& content) {
  for (const BlockEvidenceCopy& block : content) {
    digest.add(pack_in_grid(block.at).bits);
    for (std::size_t i = 0; i < block.passes.size(); i += 8) {
      std::uint64_t word = 0;
      for (std::size_t k = 0; k < 8; ++k)
        word |= std::to_integer<std::uint64_t>(block.passes[i + k]) << (8 * k);
      digest.add(word);
    }
    for (const LabelCounts& voxel : block.labels) {
      digest.add(static_cast<std::uint64_t>(voxel.place));
      for (const std::uint32_t bits : voxel.bits) digest.add(bits);
    }
  }
}

std::size_t label_voxels(const MapContent& content) {
  std::size_t count = 0;
  for (const BlockEvidenceCopy& block : content) count += block.labels.size();
  return count;
}

}  // namespace tessera::oracle
