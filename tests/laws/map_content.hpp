// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map's evidence by block, for comparing small maps fast and to the bit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tessera/base/internal/digest.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera::oracle {

/// The label counts of one voxel: bits of the counts of components 1 .. C + 1, then of the rest.
struct LabelCounts {
  static constexpr std::size_t kMost = 5;
  int place = 0;  ///< octet * 8 + voxel.
  std::array<std::uint32_t, kMost> bits{};
  friend bool operator==(const LabelCounts&, const LabelCounts&) = default;
};

struct BlockEvidenceCopy {
  BlockCoord at{};
  std::array<std::byte, kBlockVoxels> passes{};  ///< Octet by octet.
  std::vector<LabelCounts> labels;               ///< In the order of places.
  friend bool operator==(const BlockEvidenceCopy&, const BlockEvidenceCopy&) = default;
};

/// Blocks with evidence, by key. Maps of at most kMost - 2 classes.
using MapContent = std::vector<BlockEvidenceCopy>;

[[nodiscard]] MapContent content_of(const LocalMap& map);
/// The block's evidence, or null.
[[nodiscard]] const BlockEvidenceCopy* find_block(const MapContent& content, BlockCoord at);
void add_to(Digest& digest, const MapContent& content);
[[nodiscard]] std::size_t label_voxels(const MapContent& content);

}  // namespace tessera::oracle
