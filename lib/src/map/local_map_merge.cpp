// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the moving window needs of a map: blocks that leave it, and content that comes back.
#include <bit>

#include "tessera/base/internal/bits.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

Status LocalMap::merge(SlabHandle handle, int octet, int voxel, const VoxelEvidence& added,
                       std::uint8_t passes) noexcept {
  Block& block = mutable_block(handle);
  const std::uint8_t passes_here = free_passes(block, octet, voxel);
  const bool labels_here =
      ((unsigned{observed_labels(block, octet)} >> static_cast<unsigned>(voxel)) & 1U) != 0;
  if (passes_here == 0 && !labels_here) return restore(handle, octet, voxel, added, passes);
  if (passes > max_passes_ || !tuples_.holds(added)) return Status::kInvalidArgument;
  VoxelEvidence sum = evidence(block, octet, voxel);
  bool labelled = labels_here || added.rest > 0.0F;
  for (std::size_t l = 1; l < static_cast<std::size_t>(num_components()); ++l) {
    labelled = labelled || added.sigma[l] > 0.0F;
    sum.sigma[l] += added.sigma[l];
  }
  sum.rest += added.rest;
  const std::size_t layer = layer_of_octet(octet);
  if (!has_room(block, octet, labelled, passes > 0)) return Status::kResourceExhausted;
  const Change change(*this, handle);
  if (passes > 0) {
    ensure_free_page(block, layer);
    const unsigned total = unsigned{passes_here} + passes;
    store_shared(mutable_free_page(block, layer).passes[row_in_layer(row_order(octet, voxel))],
                 total < max_passes_ ? static_cast<std::uint8_t>(total) : max_passes_);
  }
  if (!labelled) return Status::kOk;
  const Status status = ensure_octet(block, octet);
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  std::byte* const tuples = pool_.at(octet_handle(block, octet));
  tuples_.condense(sum);
  tuples_.scale(tuples, voxel, 0.0F);
  tuples_.restore(tuples, voxel, sum);
  TupleStore::Plane sums = tuples_.label_sums(tuples);
  if (config_.max_evidence > 0.0F)
    hold_cap_on_labels(block, octet, 1U << static_cast<unsigned>(voxel), sums);
  update_observed(block, octet, sums);
  return Status::kOk;
}

Status LocalMap::merge_passes(SlabHandle handle, int octet, std::span<const std::byte> passes,
                              unsigned mask) noexcept {
  unsigned given = 0;
  for (unsigned rest = mask; rest != 0; rest &= rest - 1) {
    const auto voxel = static_cast<unsigned>(std::countr_zero(rest));
    const auto more = std::to_integer<std::uint8_t>(passes[voxel]);
    if (more > max_passes_) return Status::kInvalidArgument;
    given |= (more != 0 ? 1U : 0U) << voxel;
  }
  if (given == 0) return Status::kOk;
  Block& block = mutable_block(handle);
  TESSERA_ASSERT((observed_labels(block, octet) & given) == 0);
  if (!has_room(block, octet, false, true)) return Status::kResourceExhausted;
  const Change change(*this, handle);
  const std::size_t layer = layer_of_octet(octet);
  ensure_free_page(block, layer);
  FreePage& page = mutable_free_page(block, layer);
  for (unsigned rest = given; rest != 0; rest &= rest - 1) {
    const int voxel = std::countr_zero(rest);
    std::uint8_t& here = page.passes[row_in_layer(row_order(octet, voxel))];
    const unsigned total =
        here + std::to_integer<unsigned>(passes[static_cast<std::size_t>(voxel)]);
    store_shared(here, total < max_passes_ ? static_cast<std::uint8_t>(total) : max_passes_);
  }
  return Status::kOk;
}

/// Octets, with the last of a layer its page, and passes are taken back.
void LocalMap::empty_block(Block& block) noexcept {
  for (std::uint64_t octets = octets_of(block); octets != 0; octets &= octets - 1)
    update_observed(block, std::countr_zero(octets), TupleStore::Plane{});
  for (SlabHandle& page : block.free_passes) {
    if (page == 0) continue;
    pool_.release(kFreeSlab, page);
    store_shared(page, SlabHandle{0});
  }
}

void LocalMap::remove_block(SlabHandle handle) noexcept {
  Block& block = mutable_block(handle);
  // Odd until it is opened anew: readers find it whole or not at all, never emptied.
  store_shared(block.stamp, block.stamp | 1U);
  std::atomic_thread_fence(std::memory_order_release);
  index_.erase(BlockKey{block.key}, [=](SlabHandle item) { return item == handle; });
  empty_block(block);
  pool_.release(kBlockSlab, handle);
}

/// There must be room for it.
void LocalMap::fill_octet(Block& block, int octet, const BlockContent& content) noexcept {
  const BlockEvidence labels = content.labels();
  const std::uint64_t components = labels.components_of(octet);
  TupleStore::Plane rest{};
  for (int v = 0; content.any_rest() && v < kOctetVoxels; ++v)
    rest[static_cast<std::size_t>(v)] = content.rest(row_order(octet, v));
  const bool any_rest = bits_above(rest.data(), 0.0F) != 0;
  if (components == 0 && !any_rest) return;
  const Status status = ensure_octet(block, octet);
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  std::byte* const tuples = pool_.at(octet_handle(block, octet));
  TupleStore::Plane sums = tuples_.add(tuples, OctetOfBlock(labels, octet, components));
  if (any_rest) {
    tuples_.add_rest(tuples, rest, num_components());
    sums = tuples_.label_sums(tuples);
  }
  update_observed(block, octet, sums);
}

Status LocalMap::replace(SlabHandle handle, const BlockContent& content) noexcept {
  Block& block = mutable_block(handle);
  const Change change(*this, handle);
  empty_block(block);
  store_shared(block.revision, revision_);
  const std::uint64_t label_octets = content.label_octets();
  const std::uint64_t pass_octets = content.pass_octets();
  SlabPool::Counts wanted{};
  for (unsigned layer = 0; layer < kBlockLayers; ++layer) {
    constexpr std::uint64_t kOfLayer = (std::uint64_t{1} << unsigned{kLayerOctets}) - 1;
    const std::uint64_t labels = (label_octets >> (layer * kLayerOctets)) & kOfLayer;
    wanted[kLabelSlab] += labels != 0 ? 1U : 0U;
    wanted[kOctetSlab] += static_cast<std::uint32_t>(count_ones(labels));
    wanted[kFreeSlab] += ((pass_octets >> (layer * kLayerOctets)) & kOfLayer) != 0 ? 1U : 0U;
  }
  if (!pool_.fits_or_refuse(wanted)) return Status::kResourceExhausted;
  for (std::uint64_t rest = pass_octets; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    ensure_free_page(block, layer_of_octet(octet));
    FreePage& page = mutable_free_page(block, layer_of_octet(octet));
    for (int v = 0; v < kOctetVoxels; ++v) {
      const int row = row_order(octet, v);
      const unsigned passes = content.passes(row);
      store_shared(page.passes[row_in_layer(row)],
                   static_cast<std::uint8_t>(passes < max_passes_ ? passes : max_passes_));
    }
  }
  for (std::uint64_t rest = label_octets; rest != 0; rest &= rest - 1)
    fill_octet(block, std::countr_zero(rest), content);
  return Status::kOk;
}

}  // namespace tessera
