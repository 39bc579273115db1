// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels that a scan sees through (docs/design/theory.md, Evidence that can be contradicted).
#include <bit>

#include "tessera/map/internal/block_editor.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

namespace {

/// Of a voxel whose label evidence was contradicted: under what a hit brings.
constexpr int kPassesOfCleared = 2;

}  // namespace

Contradicted LocalMap::contradict(SlabHandle handle, const VoxelMask& doubted,
                                  const VoxelMask& gone) noexcept {
  const Block& block = block_at(handle);
  BlockEditor editor(*this, handle);
  Contradicted done;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const BlockEditor::Slices doubts{doubted[2 * layer], doubted[2 * layer + 1]};
    const BlockEditor::Slices goes{gone[2 * layer], gone[2 * layer + 1]};
    if (block.labels[layer] == 0 || (doubts[0] | doubts[1] | goes[0] | goes[1]) == 0) continue;
    editor.contradict(layer, doubts, goes, done);
    const BlockEditor::Slices free{done.free[2 * layer], done.free[2 * layer + 1]};
    if ((free[0] | free[1]) == 0) continue;
    if (block.free_passes[layer] == 0 && !fits_or_refuse({0, 0, 1, 0})) continue;
    editor.ensure_free_page(layer);
    for (int i = 0; i < kPassesOfCleared; ++i) static_cast<void>(editor.count_passes(layer, free));
  }
  if (done.doubted + done.cleared > 0) editor.note_revision();
  return done;
}

LocalMap::Labelled LocalMap::labelled(SlabHandle handle) noexcept {
  const Block& block = block_at(handle);
  const std::uint64_t moving = may_move(handle) ? classes().moving() : 0;
  Labelled result;
  const auto add = [](VoxelMask& mask, int octet, unsigned voxels) {
    // Two of a row, of two rows, of two slices.
    const auto corner = static_cast<unsigned>(row_order_corner(octet));
    const auto slice = [](unsigned four) {
      return std::uint64_t{(four & 3U) | (four & 12U) << 6U};
    };
    mask[corner / 64] |= slice(voxels & 15U) << (corner % 64);
    mask[corner / 64 + 1] |= slice(voxels >> 4U) << (corner % 64);
  };
  for (std::uint64_t octets = octets_of(block); octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    const unsigned observed = observed_labels(block, octet);
    add(result.all, octet, observed);
    if (moving == 0) continue;
    const std::byte* const at = pool().at(octet_handle(block, octet));
    unsigned mobile = 0;
    for (unsigned left = observed; left != 0; left &= left - 1) {
      CountSummary counts(num_components(), 0.0F);
      tuples().summarize(at, std::countr_zero(left), counts);
      if ((moving >> static_cast<unsigned>(counts.label()) & 1U) != 0) mobile |= left & (~left + 1);
    }
    add(result.moving, octet, mobile);
    result.any_moving = result.any_moving || mobile != 0;
  }
  if (moving != 0 && !result.any_moving) leave_moving(handle);
  return result;
}

}  // namespace tessera
