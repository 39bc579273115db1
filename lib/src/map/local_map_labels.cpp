// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The labels' half of writing to a LocalMap (local_map_write.cpp says what holds for both).
#include <array>
#include <bit>

#include "tessera/base/internal/bits.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

Status LocalMap::ensure_octet(Block& block, int octet) noexcept {
  if (has_octet(block, octet)) return Status::kOk;
  SlabHandle& labels = block.labels[layer_of_octet(octet)];
  if (labels == 0) {
    if (!pool_.fits_or_refuse({0, 1, 0, 1})) return Status::kResourceExhausted;
    const Result<SlabHandle> page = pool_.allocate(kLabelSlab);
    TESSERA_ASSERT(page.ok());
    store_shared(labels, *page);
  }
  const Result<SlabHandle> tuples = pool_.allocate(kOctetSlab, tuples_.zeroed_bytes());
  if (!tuples.ok()) return tuples.status();
  store_shared(mutable_label_page(block, layer_of_octet(octet)).octets[octet_in_layer(octet)],
               *tuples);
  note_usage();
  return Status::kOk;
}

void LocalMap::update_observed(Block& block, int octet, const TupleStore::Plane& sums) noexcept {
  const std::size_t layer = layer_of_octet(octet);
  LabelPage& page = mutable_label_page(block, layer);
  SlabHandle& tuples = page.octets[octet_in_layer(octet)];
  const unsigned now = bits_above(sums.data(), 0.0F);
  std::uint8_t& observed = page.observed[octet_in_layer(octet)];
  if (now == observed && now != 0) return;
  const int change = count_ones(now) - count_ones(observed);
  store_shared(observed, static_cast<std::uint8_t>(now));
  store_shared(block.label_voxels,
               static_cast<std::uint32_t>(static_cast<int>(block.label_voxels) + change));
  label_voxels_ = static_cast<std::uint64_t>(static_cast<std::int64_t>(label_voxels_) + change);
  if (now != 0) return;
  pool_.release(kOctetSlab, tuples);
  store_shared(tuples, SlabHandle{0});
  for (const SlabHandle other : page.octets) {
    if (other != 0) return;
  }
  pool_.release(kLabelSlab, block.labels[layer]);
  store_shared(block.labels[layer], SlabHandle{0});
}

void LocalMap::hold_cap_on_labels(Block& block, int octet, unsigned voxels,
                                  TupleStore::Plane& sums) noexcept {
  const float cap = config_.max_evidence;
  const float w = config_.free_weight;
  std::byte* const tuples = pool_.at(octet_handle(block, octet));
  for (; voxels != 0; voxels &= voxels - 1) {
    const int v = std::countr_zero(voxels);
    float& labels = sums[static_cast<std::size_t>(v)];
    const std::uint8_t passes = free_passes(block, octet, v);
    const float total = labels + static_cast<float>(passes) * w;
    if (!(total > cap)) continue;
    float free = 0.0F;
    if (passes > 0) {
      // Whole passes only, rounded down: a voxel rather stays occupied than is declared free by
      // rounding.
      const auto kept = static_cast<std::uint8_t>(static_cast<float>(passes) * (cap / total));
      FreePage& page = mutable_free_page(block, layer_of_octet(octet));
      store_shared(page.passes[row_in_layer(row_order(octet, v))], kept);
      free = static_cast<float>(kept) * w;
    }
    if (!(labels > cap - free)) continue;
    tuples_.scale(tuples, v, (cap - free) / labels);
    labels = cap - free;
  }
}

/// The octet must be there.
template <class Evidence>
void LocalMap::add_to_octet(Block& block, int octet, const Evidence& added) noexcept {
  TupleStore::Plane sums = tuples_.add(pool_.at(octet_handle(block, octet)), added);
  // Mostly there are no passes and no full voxel.
  if (config_.max_evidence > 0.0F && (block.free_passes[layer_of_octet(octet)] != 0 ||
                                      bits_above(sums.data(), config_.max_evidence) != 0))
    hold_cap_on_labels(block, octet, labelled_voxels(added), sums);
  update_observed(block, octet, sums);
}

Status LocalMap::add_labels(SlabHandle handle, int octet, const OctetEvidence& added) noexcept {
  if ((added.components() & ~std::uint64_t{1}) == 0) return Status::kOk;
  Block& block = mutable_block(handle);
  const Change change(*this, handle);
  const Status status = ensure_octet(block, octet);
  if (status != Status::kOk) return status;
  add_to_octet(block, octet, added);
  store_shared(block.revision, revision_);
  return Status::kOk;
}

/// In rounds, so that the octets' memory, which mostly is in no cache, is waited for together.
Result<int> LocalMap::add_labels(SlabHandle handle, std::uint64_t octets,
                                 const BlockEvidence& added) noexcept {
  std::array<std::uint64_t, kBlockOctets> components{};
  std::uint64_t wanted = 0;
  for (; octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    std::uint64_t& present = components[static_cast<std::size_t>(octet)];
    present = added.components_of(octet) & ~std::uint64_t{1};
    if (present != 0) wanted |= octets & (~octets + 1);
  }
  if (wanted == 0) return 0;
  Block& block = mutable_block(handle);
  const Change change(*this, handle);
  Status status = Status::kOk;
  std::uint64_t ready = 0;
  for (std::uint64_t rest = wanted; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    status = ensure_octet(block, octet);
    if (status != Status::kOk) break;
    tuples_.prefetch_to_add(pool_.at(octet_handle(block, octet)));
    ready |= rest & (~rest + 1);
  }
  for (std::uint64_t rest = ready; rest != 0; rest &= rest - 1)
    tuples_.prefetch_planes(pool_.at(octet_handle(block, std::countr_zero(rest))));
  for (std::uint64_t rest = ready; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    add_to_octet(block, octet,
                 OctetOfBlock(added, octet, components[static_cast<std::size_t>(octet)]));
  }
  if (ready != 0) store_shared(block.revision, revision_);
  if (status != Status::kOk) return status;
  return count_ones(ready);
}

void LocalMap::prefetch_pages(SlabHandle handle) const noexcept {
  if (handle == 0) return;
  for (const SlabHandle page : block_at(handle).labels) {
    if (page != 0) __builtin_prefetch(pool_.at(page), 1);
  }
}

void LocalMap::prefetch_octets(SlabHandle handle, std::uint64_t octets) const noexcept {
  if (handle == 0) return;
  for (; octets != 0; octets &= octets - 1) {
    const SlabHandle tuples = octet_handle(block_at(handle), std::countr_zero(octets));
    if (tuples != 0) tuples_.prefetch_to_add(pool_.at(tuples));
  }
}

}  // namespace tessera
