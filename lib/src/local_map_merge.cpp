// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the moving window needs of a map: blocks that leave it, and content that comes back.
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
  const bool new_free_page = passes > 0 && block.free_passes[layer] == 0;
  const bool new_octet = labelled && !has_octet(block, octet);
  if (!pool_.fits_or_refuse({0, new_octet && block.labels[layer] == 0 ? 1U : 0U,
                             new_free_page ? 1U : 0U, new_octet ? 1U : 0U})) {
    return Status::kResourceExhausted;
  }
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

void LocalMap::remove_block(SlabHandle handle) noexcept {
  {
    const Change change(*this, handle);
    Block& block = mutable_block(handle);
    for (int octet = 0; octet < kBlockOctets; ++octet) {
      // Nothing observed any more: octets, and with the last of a layer its page, are taken back.
      if (has_octet(block, octet)) update_observed(block, octet, TupleStore::Plane{});
    }
    for (SlabHandle& page : block.free_passes) {
      if (page == 0) continue;
      pool_.release(kFreeSlab, page);
      store_shared(page, SlabHandle{0});
    }
  }
  close_if_empty(handle);
}

}  // namespace tessera
