// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The writing half of LocalMap. Cap arithmetic: with n free passes of weight w, labels summing to s
// and the cap S, n w + s <= S holds after every call (to float rounding). All stores to what
// readers of other threads may see are shared ones, within a Change of the block.
#include <algorithm>
#include <cstring>

#include "tessera/base/internal/bits.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

Result<SlabHandle> LocalMap::open_block(BlockCoord block) noexcept {
  const Result<BlockKey> key = pack(block);
  if (!key.ok()) return key.status();
  if (const SlabHandle handle = find_handle(*key); handle != 0) return handle;
  // The index first: a block taken from the pool and given back would keep its page from other
  // uses.
  const bool fits = pool_.fits_or_refuse({1, 0, 0, 0});
  const Result<BlockIndex::Place> place =
      fits ? index_.make_room(*key) : Result<BlockIndex::Place>(Status::kResourceExhausted);
  if (!place.ok()) {
    ++blocks_refused_;
    note_usage();
    return Status::kResourceExhausted;
  }
  const Result<SlabHandle> handle = pool_.allocate(kBlockSlab);
  TESSERA_ASSERT(handle.ok());
  Block& opened = mutable_block(*handle);
  store_shared(opened.key, key->bits);
  stamp_anew(opened);
  index_.insert(*place, *key, *handle);
  note_usage();
  return *handle;
}

void LocalMap::close_if_empty(SlabHandle handle) noexcept {
  Block& block = mutable_block(handle);
  if (block.has_labels() || block.has_free_passes()) return;
  // Odd until it is opened anew.
  store_shared(block.stamp, block.stamp | 1U);
  std::atomic_thread_fence(std::memory_order_release);
  index_.erase(BlockKey{block.key}, [=](SlabHandle item) { return item == handle; });
  pool_.release(kBlockSlab, handle);
}

void LocalMap::restore_revision(SlabHandle block, std::uint32_t revision) noexcept {
  const Change change(*this, block);
  store_shared(mutable_block(block).revision, revision);
}

void LocalMap::close_empty_blocks() noexcept {
  index_.for_each([this](SlabHandle handle) { close_if_empty(handle); });
}

/// There must be storage for it.
void LocalMap::ensure_free_page(Block& block, std::size_t layer) noexcept {
  if (block.free_passes[layer] != 0) return;
  const Result<SlabHandle> page = pool_.allocate(kFreeSlab);
  TESSERA_ASSERT(page.ok());
  store_shared(block.free_passes[layer], *page);
  note_usage();
}

bool LocalMap::give_way_to_free(Block& block, int octet, int voxel, std::uint8_t passes) noexcept {
  std::byte* const tuples = pool_.at(octet_handle(block, octet));
  TupleStore::Plane sums = tuples_.label_sums(tuples);
  float& labels = sums[static_cast<std::size_t>(voxel)];
  const float room = config_.max_evidence - static_cast<float>(passes) * config_.free_weight;
  // What is left beside a saturated free layer is rounding of the cap to whole passes.
  const float kept = passes == max_passes_ || room <= 0.0F ? 0.0F : room;
  if (labels <= kept) return false;
  tuples_.scale(tuples, voxel, kept / labels);
  labels = kept;
  if (kept == 0.0F) update_observed(block, octet, sums);
  return true;
}

namespace {

/// Adds one to the bytes of eight passes whose bit is set in row, but not to those at `most`.
/// Returns the bytes that were added to, a one each.
std::uint64_t add_to_row(std::uint64_t& passes, std::uint64_t row, std::uint8_t most) noexcept {
  constexpr std::uint64_t kOnes = 0x0101010101010101U;
  constexpr std::uint64_t kLow = 0x7f7f7f7f7f7f7f7fU;
  // Bit i of the row to byte i: there as its own bit, then as the byte's top bit, then as a one.
  const std::uint64_t spread = (row * kOnes) & 0x8040201008040201U;
  const std::uint64_t wanted = ((spread + kLow) >> 7U) & kOnes;
  const std::uint64_t below = passes ^ (kOnes * most);  // zero bytes: full
  const std::uint64_t open = ((((below & kLow) + kLow) | below) >> 7U) & kOnes;
  passes += wanted & open;
  return wanted & open;
}

/// One pass more for the voxels of two slices of a block. Returns whether anything changed.
bool count_passes(FreePage& page, const std::array<std::uint64_t, 2>& slices,
                  std::uint8_t most) noexcept {
  std::uint64_t added = 0;
  for (std::size_t row = 0; row < std::size_t{2} * kBlockEdge; ++row) {
    const std::uint64_t bits = (slices[row / 8] >> (8 * (row % 8))) & 0xffU;
    if (bits == 0) continue;
    std::uint8_t* const at = &page.passes[8 * row];
    std::uint64_t passes = 0;
    std::memcpy(&passes, at, 8);
    added |= add_to_row(passes, bits, most);
    store_shared_words(at, &passes, 8);
  }
  return added != 0;
}

}  // namespace

/// Labels give way where the cap is reached.
bool LocalMap::give_way_in_layer(Block& block, std::size_t layer,
                                 const std::array<std::uint64_t, 2>& slices) noexcept {
  bool changed = false;
  for (std::size_t i = 0; i < kLayerOctets; ++i) {
    const int octet = static_cast<int>(layer * kLayerOctets + i);
    const unsigned observed = observed_labels(block, octet);
    if (observed == 0) continue;
    // The octet's eight bits: two of a row, of two rows, of two slices.
    const auto corner = static_cast<unsigned>(2 * (i & 3U) + 16 * (i >> 2U));
    const auto of_slice = [corner](std::uint64_t slice) {
      const auto rows = static_cast<unsigned>(slice >> corner);
      return (rows & 3U) | ((rows >> 6U) & 12U);
    };
    unsigned carved = observed & (of_slice(slices[0]) | (of_slice(slices[1]) << 4U));
    for (; carved != 0; carved &= carved - 1) {
      const int voxel = std::countr_zero(carved);
      changed = give_way_to_free(block, octet, voxel, free_passes(block, octet, voxel)) || changed;
    }
  }
  return changed;
}

Status LocalMap::add_free_pass(SlabHandle handle, const VoxelMask& mask) noexcept {
  Block& block = mutable_block(handle);
  const std::uint32_t new_pages = free_pages_needed(block, mask);
  if (new_pages > 0 && !pool_.fits_or_refuse({0, 0, new_pages, 0}))
    return Status::kResourceExhausted;
  const Change change(*this, handle);
  bool changed = false;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const std::array<std::uint64_t, 2> slices{mask[2 * layer], mask[2 * layer + 1]};
    if ((slices[0] | slices[1]) == 0) continue;
    ensure_free_page(block, layer);
    changed = count_passes(mutable_free_page(block, layer), slices, max_passes_) || changed;
    if (config_.max_evidence > 0.0F && block.labels[layer] != 0)
      changed = give_way_in_layer(block, layer, slices) || changed;
  }
  if (changed) store_shared(block.revision, revision_);
  return Status::kOk;
}

bool LocalMap::has_room(const Block& block, int octet, bool labels, bool passes) noexcept {
  const std::size_t layer = layer_of_octet(octet);
  const bool new_octet = labels && !has_octet(block, octet);
  const bool new_label_page = new_octet && block.labels[layer] == 0;
  const bool new_free_page = passes && block.free_passes[layer] == 0;
  return pool_.fits_or_refuse(
      {0, new_label_page ? 1U : 0U, new_free_page ? 1U : 0U, new_octet ? 1U : 0U});
}

Status LocalMap::restore(SlabHandle handle, int octet, int voxel, const VoxelEvidence& evidence,
                         std::uint8_t passes) noexcept {
  if (passes > max_passes_ || !tuples_.holds(evidence)) return Status::kInvalidArgument;
  Block& block = mutable_block(handle);
  bool labelled = evidence.rest > 0.0F;
  for (int l = 1; l < num_components(); ++l)
    labelled = labelled || evidence.sigma[static_cast<std::size_t>(l)] > 0.0F;
  const std::size_t layer = layer_of_octet(octet);
  if (!has_room(block, octet, labelled, passes > 0)) return Status::kResourceExhausted;
  const Change change(*this, handle);
  if (passes > 0) {
    ensure_free_page(block, layer);
    FreePage& page = mutable_free_page(block, layer);
    store_shared(page.passes[row_in_layer(row_order(octet, voxel))], passes);
  }
  if (!labelled) return Status::kOk;
  const Status status = ensure_octet(block, octet);
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  std::byte* const tuples = pool_.at(octet_handle(block, octet));
  tuples_.restore(tuples, voxel, evidence);
  update_observed(block, octet, tuples_.label_sums(tuples));
  return Status::kOk;
}

}  // namespace tessera
