// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels that a scan sees through (docs/design/theory.md, Evidence that can be contradicted).
#include <bit>

#include "tessera/base/internal/bits.hpp"
#include "tessera/base/internal/lanes.hpp"
#include "tessera/map/internal/block_editor.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

namespace {

/// Of a voxel whose label evidence was contradicted: under what a hit brings.
constexpr unsigned kPassesOfCleared = 2;

}  // namespace

unsigned BlockEditor::contradict(int octet, unsigned voxels, unsigned going, float left) noexcept {
  // A pass and a quarter, so that against one pass it is occupied; by less than half of that more,
  // which is no hit, it is doubted still.
  const float doubted = 1.25F * table_.config_.free_weight;
  std::byte* const at = tuples(octet);
  const TupleStore::Plane sums = table_.tuples_.label_sums(at);
  for (unsigned rest = voxels; rest != 0; rest &= rest - 1) {
    const int voxel = std::countr_zero(rest);
    const float labels = sums[static_cast<std::size_t>(voxel)];
    if (labels <= 1.5F * doubted) going |= rest & (~rest + 1);
    const float most = ((going >> static_cast<unsigned>(voxel)) & 1U) != 0 ? left : doubted;
    if (labels <= most) continue;
    table_.tuples_.scale(at, voxel, most / labels);
  }
  if ((going & voxels) != 0) update_observed(octet, table_.tuples_.label_sums(at));
  return going & voxels;
}

void BlockEditor::contradict(std::size_t layer, const Slices& doubted, const Slices& gone,
                             bool with_passes, Contradicted& counts) noexcept {
  const float left = with_passes ? 0.25F * table_.config_.free_weight : 0.0F;
  for (std::size_t i = 0; i < kLayerOctets; ++i) {
    const int octet = static_cast<int>(layer * kLayerOctets + i);
    const unsigned going = of_octet(gone, i);
    const unsigned voxels = table_.observed_labels(block_, octet) & (of_octet(doubted, i) | going);
    if (voxels == 0) continue;
    const unsigned went = contradict(octet, voxels, going, left);
    counts.cleared += static_cast<std::uint32_t>(count_ones(went));
    counts.doubted += static_cast<std::uint32_t>(count_ones(voxels & ~went));
    if (!with_passes) continue;
    for (unsigned rest = went; rest != 0; rest &= rest - 1) {
      const int voxel = std::countr_zero(rest);
      set_passes(octet, voxel, table_.free_passes(block_, octet, voxel) + kPassesOfCleared);
    }
  }
}

Contradicted LocalMap::contradict(SlabHandle handle, const VoxelMask& doubted,
                                  const VoxelMask& gone) noexcept {
  const Block& block = block_at(handle);
  BlockEditor editor(*this, handle);
  Contradicted done;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const BlockEditor::Slices doubts{doubted[2 * layer], doubted[2 * layer + 1]};
    const BlockEditor::Slices goes{gone[2 * layer], gone[2 * layer + 1]};
    if (block.labels[layer] == 0 || (doubts[0] | doubts[1] | goes[0] | goes[1]) == 0) continue;
    editor.contradict(layer, doubts, goes, block.free_passes[layer] != 0, done);
  }
  if (done.doubted + done.cleared > 0) editor.note_revision();
  return done;
}

namespace {

struct OccupiedInOctet {
  unsigned observed = 0;  ///< With labels.
  unsigned all = 0;
  unsigned faint = 0;
};
/// Those of an octet's voxels with labels whose labels are more than their passes weigh.
OccupiedInOctet occupied_of(const LocalMap& map, const Block& block, int octet) noexcept {
  const unsigned observed = map.observed_labels(block, octet);
  const TupleStore::Plane sums =
      map.tuples().label_sums(map.pool().at(map.octet_handle(block, octet)));
  const std::array<std::uint8_t, kOctetVoxels> passes = map.passes_of(block, octet);
  const float weight = map.config().free_weight;
  unsigned all = 0;
  for (std::size_t v = 0; v < sums.size(); v += 4) {
    const Float4 of_passes{static_cast<float>(passes[v]), static_cast<float>(passes[v + 1]),
                           static_cast<float>(passes[v + 2]), static_cast<float>(passes[v + 3])};
    all |= bits_of(load4(&sums[v]) > of_passes * weight) << v;
  }
  all &= observed;
  const unsigned faint = all & ~bits_above(sums.data(), LocalMap::Occupied::kFaint);
  return {.observed = observed, .all = all, .faint = faint};
}

/// Whether any of an octet's voxels has evidence of a class that may move.
bool holds_moving(const LocalMap& map, const std::byte* octet, unsigned observed,
                  std::uint64_t moving) noexcept {
  bool found = false;
  for (unsigned left = observed; left != 0 && !found; left &= left - 1) {
    map.tuples().visit(
        octet, std::countr_zero(left),
        [&](int component, float count) {
          found = found || (count > 0.0F && (moving >> static_cast<unsigned>(component) & 1U) != 0);
        },
        [](float) {});
  }
  return found;
}

/// Adds an octet's voxels: two of a row, of two rows, of two slices.
void add_octet(VoxelMask& mask, int octet, unsigned voxels) noexcept {
  const auto corner = static_cast<unsigned>(row_order_corner(octet));
  const auto slice = [](unsigned four) { return std::uint64_t{(four & 3U) | (four & 12U) << 6U}; };
  mask[corner / 64] |= slice(voxels & 15U) << (corner % 64);
  mask[corner / 64 + 1] |= slice(voxels >> 4U) << (corner % 64);
}

}  // namespace

LocalMap::Occupied LocalMap::occupied(SlabHandle handle, const VoxelMask& asked) noexcept {
  const Block& block = block_at(handle);
  const std::uint64_t moving = may_move(handle) ? classes().moving() : 0;
  Occupied result;
  bool holds = false;
  // All of them, so that their memory is waited for together.
  for (std::uint64_t octets = octets_of(block); octets != 0; octets &= octets - 1)
    tuples().prefetch(pool().at(octet_handle(block, std::countr_zero(octets))));
  for (std::uint64_t octets = octets_of(block); octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    const std::size_t layer = layer_of_octet(octet);
    const BlockEditor::Slices slices{asked[2 * layer], asked[2 * layer + 1]};
    const std::size_t in_layer = static_cast<std::size_t>(octet) % kLayerOctets;
    if (moving == 0 && BlockEditor::of_octet(slices, in_layer) == 0) continue;
    const OccupiedInOctet occupied = occupied_of(*this, block, octet);
    add_octet(result.all, octet, occupied.all);
    add_octet(result.faint, octet, occupied.faint);
    if (moving == 0) continue;
    const std::byte* const at = pool().at(octet_handle(block, octet));
    unsigned mobile = 0;
    for (unsigned left = occupied.all; left != 0; left &= left - 1) {
      CountSummary counts(num_components(), 0.0F);
      tuples().summarize(at, std::countr_zero(left), counts);
      if ((moving >> static_cast<unsigned>(counts.label()) & 1U) != 0) mobile |= left & (~left + 1);
    }
    add_octet(result.moving, octet, mobile);
    result.any_moving = result.any_moving || mobile != 0;
    holds = holds || mobile != 0 || holds_moving(*this, at, occupied.observed, moving);
  }
  // By what it holds, as it joins, so that a map that was loaded goes on as the one in memory.
  if (moving != 0 && !holds) leave_moving(handle);
  return result;
}

}  // namespace tessera
