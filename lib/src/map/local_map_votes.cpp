// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels by votes (label_votes.hpp).
#include <bit>

#include "tessera/base/internal/bits.hpp"
#include "tessera/map/internal/block_editor.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

Status OctetWriter::add(int octet, const OctetEvidence& added, const LabelShares& shares) noexcept {
  const bool shared = shares.count != 0;
  const unsigned voxels = shared ? labelled_voxels(added) : 0;
  if (shared ? voxels == 0 : (added.components() & ~std::uint64_t{1}) == 0) return Status::kOk;
  // One for each octet: who reads meanwhile waits for what is written, not for what is computed.
  BlockEditor editor(table_, handle_);
  const Status status = editor.ensure_octet(octet);
  if (status != Status::kOk) return status;
  // The layer has votes, which tiles to come look at.
  if (shared) editor.keep_label_pages();
  shared ? editor.add_labels(octet, added, voxels, shares) : editor.add_labels(octet, added);
  editor.note_revision();
  return Status::kOk;
}

Status LocalMap::add_labels(SlabHandle handle, int octet, const OctetEvidence& added,
                            const LabelShares& shares) noexcept {
  return OctetWriter(*this, handle).add(octet, added, shares);
}

Status LocalMap::open_label_layers(SlabHandle handle, unsigned layers) noexcept {
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer)
    if (block_at(handle).labels[layer] != 0) layers &= ~(1U << layer);
  if (layers == 0) return Status::kOk;
  if (!fits_or_refuse({0, static_cast<std::uint32_t>(count_ones(layers)), 0, 0}))
    return Status::kResourceExhausted;
  BlockEditor editor(*this, handle);
  for (; layers != 0; layers &= layers - 1)
    editor.ensure_label_page(static_cast<std::size_t>(std::countr_zero(layers)));
  return Status::kOk;
}

void LocalMap::close_empty_label_layers(SlabHandle handle) noexcept {
  const std::uint64_t octets = octets_of(block_at(handle));
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const std::uint64_t here = (octets >> (kLayerOctets * layer)) & 0xffffU;
    if (block_at(handle).labels[layer] != 0 && here == 0)
      BlockEditor(*this, handle).drop_label_page(layer);
  }
}

namespace {

/// Votes of a count that a map has, whose points are not known.
std::uint32_t votes_of_count(float count) noexcept {
  return LabelVotes::votes_of(count * (LabelVotes::kPerPoint / 4.0F));
}

}  // namespace

void LocalMap::begin_votes(SlabHandle handle, std::size_t layer) noexcept {
  const Block& block = block_at(handle);
  LabelVotes found;
  found.begun = true;
  const int first = static_cast<int>(layer) * kLayerOctets;
  for (int octet = first; octet < first + kLayerOctets; ++octet) {
    for (unsigned left = observed_labels(block, octet); left != 0; left &= left - 1) {
      visit_labels(
          block, octet, std::countr_zero(left),
          [&](int component, float count) {
            if (component > classes().num_classes()) return;
            found.add(LabelVotes::cell_of_octet(octet), static_cast<std::uint8_t>(component),
                      votes_of_count(count));
          },
          [](float) {});
    }
  }
  set_votes(handle, layer, found);
}

void LocalMap::set_votes(SlabHandle handle, std::size_t layer, const LabelVotes& votes) noexcept {
  BlockEditor(*this, handle).set_votes(layer, votes);
}

void LocalMap::vote_as(BlockEditor& editor, SlabHandle handle, int octet,
                       const VoxelEvidence& evidence) noexcept {
  const Block& block = block_at(handle);
  const std::size_t layer = layer_of_octet(octet);
  if (!keeps_votes() || block.labels[layer] == 0) return;
  LabelVotes votes = this->votes(block, layer);
  if (!votes.begun) return;
  for (int label = 1; label <= classes().num_classes(); ++label) {
    votes.add(LabelVotes::cell_of_octet(octet), static_cast<std::uint8_t>(label),
              votes_of_count(evidence.sigma[static_cast<std::size_t>(label)]));
  }
  editor.set_votes(layer, votes);
}

}  // namespace tessera
