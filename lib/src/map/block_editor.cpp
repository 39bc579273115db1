// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/internal/block_editor.hpp"

#include <bit>
#include <cstring>

#include "tessera/base/internal/bits.hpp"

namespace tessera {

// --- Labels --------------------------------------------------------------------------------------

Status BlockEditor::ensure_octet(int octet) noexcept {
  if (table_.octet_handle(block_, octet) != 0) return Status::kOk;
  SlabPool& pool = table_.pool_;
  if (block_.labels[layer_of_octet(octet)] == 0) {
    if (!pool.fits_or_refuse({0, 1, 0, 1})) return Status::kResourceExhausted;
    ensure_label_page(layer_of_octet(octet));
  }
  const Result<SlabHandle> tuples = pool.allocate(kOctetSlab, table_.tuples_.zeroed_bytes());
  if (!tuples.ok()) return tuples.status();
  store_shared(label_page(layer_of_octet(octet)).octets[octet_in_layer(octet)], *tuples);
  table_.note_usage();
  return Status::kOk;
}

void BlockEditor::ensure_label_page(std::size_t layer) noexcept {
  if (block_.labels[layer] != 0) return;
  const Result<SlabHandle> page = table_.pool_.allocate(kLabelSlab);
  TESSERA_ASSERT(page.ok());
  store_shared(block_.labels[layer], *page);
  table_.note_usage();
}

void BlockEditor::drop_label_page(std::size_t layer) noexcept {
  for (const SlabHandle octet : label_page(layer).octets) {
    if (octet != 0) return;
  }
  table_.pool_.release(kLabelSlab, block_.labels[layer]);
  store_shared(block_.labels[layer], SlabHandle{0});
}

void BlockEditor::add_labels(int octet, const OctetEvidence& added, unsigned voxels,
                             const LabelShares& shares) noexcept {
  note_components(shares.components());
  TupleStore::Plane sums =
      table_.tuples_.add_shared(tuples(octet), added, voxels, shares, table_.num_components());
  end_adding(
      octet, [voxels] { return voxels; }, sums);
}

void BlockEditor::update_observed(int octet, const TupleStore::Plane& sums) noexcept {
  const std::size_t layer = layer_of_octet(octet);
  LabelPage& page = label_page(layer);
  SlabHandle& tuples = page.octets[octet_in_layer(octet)];
  const unsigned now = bits_above(sums.data(), 0.0F);
  std::uint8_t& observed = page.observed[octet_in_layer(octet)];
  if (now == observed && now != 0) return;
  const int change = count_ones(now) - count_ones(observed);
  store_shared(observed, static_cast<std::uint8_t>(now));
  store_shared(block_.label_voxels,
               static_cast<std::uint32_t>(static_cast<int>(block_.label_voxels) + change));
  table_.label_voxels_ =
      static_cast<std::uint64_t>(static_cast<std::int64_t>(table_.label_voxels_) + change);
  if (now != 0) return;
  table_.pool_.release(kOctetSlab, tuples);
  store_shared(tuples, SlabHandle{0});
  if (!keeps_label_pages_) drop_label_page(layer);
}

namespace {

/// Voxels whose labels and passes are above the cap, a bit each.
unsigned full_voxels(const TupleStore::Plane& sums,
                     const std::array<std::uint8_t, kOctetVoxels>& passes, float weight,
                     float cap) noexcept {
  TupleStore::Plane totals;
  for (std::size_t v = 0; v < totals.size(); ++v)
    totals[v] = sums[v] + static_cast<float>(passes[v]) * weight;
  return bits_above(totals.data(), cap);
}

}  // namespace

void BlockEditor::hold_cap(int octet, unsigned voxels, TupleStore::Plane& sums) noexcept {
  const float cap = table_.config_.max_evidence;
  const float w = table_.config_.free_weight;
  const std::array<std::uint8_t, kOctetVoxels> passes_before = table_.passes_of(block_, octet);
  voxels &= full_voxels(sums, passes_before, w, cap);
  std::byte* const tuples_of_octet = tuples(octet);
  for (; voxels != 0; voxels &= voxels - 1) {
    const int v = std::countr_zero(voxels);
    float& labels = sums[static_cast<std::size_t>(v)];
    const std::uint8_t passes = passes_before[static_cast<std::size_t>(v)];
    const float total = labels + static_cast<float>(passes) * w;
    float free = 0.0F;
    if (passes > 0) {
      // Whole passes only, rounded down: a voxel rather stays occupied than is declared free by
      // rounding.
      const auto kept = static_cast<std::uint8_t>(static_cast<float>(passes) * (cap / total));
      set_passes(octet, v, kept);
      free = static_cast<float>(kept) * w;
    }
    if (!(labels > cap - free)) continue;
    table_.tuples_.scale(tuples_of_octet, v, (cap - free) / labels);
    labels = cap - free;
  }
}

void BlockEditor::set_labels(int octet, int voxel, const VoxelEvidence& evidence,
                             bool with_cap) noexcept {
  const Status status = ensure_octet(octet);
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  const bool observed =
      ((unsigned{table_.observed_labels(block_, octet)} >> static_cast<unsigned>(voxel)) & 1U) != 0;
  std::byte* const at = tuples(octet);
  for (int l = 1; l < evidence.num_components; ++l) {
    if (evidence.sigma[static_cast<std::size_t>(l)] > 0.0F) note_components(std::uint64_t{1} << l);
  }
  if (observed) table_.tuples_.scale(at, voxel, 0.0F);
  table_.tuples_.restore(at, voxel, evidence);
  TupleStore::Plane sums = table_.tuples_.label_sums(at);
  if (with_cap && table_.config_.max_evidence > 0.0F)
    hold_cap(octet, 1U << static_cast<unsigned>(voxel), sums);
  update_observed(octet, sums);
}

void BlockEditor::fill_octet(int octet, const BlockContent& content) noexcept {
  const BlockEvidence labels = content.labels();
  const std::uint64_t components = labels.components_of(octet);
  TupleStore::Plane rest{};
  for (int v = 0; content.any_rest() && v < kOctetVoxels; ++v)
    rest[static_cast<std::size_t>(v)] = content.rest(row_order(octet, v));
  const bool any_rest = bits_above(rest.data(), 0.0F) != 0;
  if (components == 0 && !any_rest) return;
  const Status status = ensure_octet(octet);
  TESSERA_ASSERT(status == Status::kOk);
  static_cast<void>(status);
  note_components(components);
  std::byte* const at = tuples(octet);
  if (any_rest)
    table_.tuples_.add_rest(at, rest, labels.centroids_of(octet), table_.num_components());
  update_observed(octet, table_.tuples_.add(at, OctetOfBlock(labels, octet, components)));
}

// --- Free passes ---------------------------------------------------------------------------------

void BlockEditor::ensure_free_page(std::size_t layer) noexcept {
  if (block_.free_passes[layer] != 0) return;
  const Result<SlabHandle> page = table_.pool_.allocate(kFreeSlab);
  TESSERA_ASSERT(page.ok());
  store_shared(block_.free_passes[layer], *page);
  table_.note_usage();
}

bool BlockEditor::count_passes(std::size_t layer, const Slices& slices) noexcept {
  using Bytes = std::uint8_t __attribute__((vector_size(16)));
  constexpr Bytes kBits{1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
  constexpr std::uint64_t kOnes = 0x0101010101010101U;
  FreePage& page = free_page(layer);
  const Bytes most = Bytes{} + table_.max_passes_;
  Bytes added{};
  for (std::size_t rows = 0; rows < std::size_t{2} * kBlockEdge; rows += 2) {
    const std::uint64_t bits = (slices[rows / 8] >> (8 * (rows % 8))) & 0xffffU;
    if (bits == 0) continue;
    // A row's bits in each of its eight bytes.
    const std::array<std::uint64_t, 2> of_rows{(bits & 0xffU) * kOnes, (bits >> 8U) * kOnes};
    Bytes wanted;
    Bytes passes;
    std::memcpy(&wanted, of_rows.data(), sizeof(wanted));
    std::uint8_t* const at = &page.passes[8 * rows];
    std::memcpy(&passes, at, sizeof(passes));
    // All ones where there is one more.
    const auto more =
        __builtin_convertvector(((wanted & kBits) == kBits) & (passes != most), Bytes);
    added |= more;
    passes -= more;
    std::array<std::uint64_t, 2> words{};
    std::memcpy(words.data(), &passes, sizeof(words));
    store_shared_words(at, words.data(), sizeof(words));
  }
  std::array<std::uint64_t, 2> any{};
  std::memcpy(any.data(), &added, sizeof(any));
  return (any[0] | any[1]) != 0;
}

bool BlockEditor::give_way_to_free(BlockTable& table, int octet, int voxel) noexcept {
  std::byte* const at = tuples(octet);
  TupleStore::Plane sums = table.tuples_.label_sums(at);
  float& labels = sums[static_cast<std::size_t>(voxel)];
  const std::uint8_t passes = table.free_passes(block_, octet, voxel);
  const float room =
      table.config_.max_evidence - static_cast<float>(passes) * table.config_.free_weight;
  // What is left beside a saturated free layer is rounding of the cap to whole passes.
  const float kept = passes == table.max_passes_ || room <= 0.0F ? 0.0F : room;
  if (labels <= kept) return false;
  table.tuples_.scale(at, voxel, kept / labels);
  labels = kept;
  if (kept == 0.0F) update_observed(octet, sums);
  return true;
}

unsigned BlockEditor::of_octet(const Slices& slices, std::size_t octet_in_layer) noexcept {
  const auto corner =
      static_cast<unsigned>(2 * (octet_in_layer & 3U) + 16 * (octet_in_layer >> 2U));
  const auto of_slice = [corner](std::uint64_t slice) {
    const auto rows = static_cast<unsigned>(slice >> corner);
    return (rows & 3U) | ((rows >> 6U) & 12U);
  };
  return of_slice(slices[0]) | (of_slice(slices[1]) << 4U);
}

bool BlockEditor::give_way(std::size_t layer, const Slices& slices) noexcept {
  BlockTable& table = table_;
  bool changed = false;
  for (std::size_t i = 0; i < kLayerOctets; ++i) {
    const int octet = static_cast<int>(layer * kLayerOctets + i);
    const unsigned observed = table.observed_labels(block_, octet);
    if (observed == 0) continue;
    for (unsigned carved = observed & of_octet(slices, i); carved != 0; carved &= carved - 1)
      changed = give_way_to_free(table, octet, std::countr_zero(carved)) || changed;
  }
  return changed;
}

void BlockEditor::add_passes(int octet, std::span<const std::byte> passes, unsigned mask) noexcept {
  const unsigned most = table_.max_passes_;
  const auto corner = static_cast<unsigned>(row_in_layer(row_order_corner(octet)));
  std::uint8_t* const here = free_page(layer_of_octet(octet)).passes.data() + corner;
  for (; mask != 0; mask &= mask - 1) {
    const int voxel = std::countr_zero(mask);
    std::uint8_t& there = here[row_order(0, voxel)];
    const unsigned total =
        there + std::to_integer<unsigned>(passes[static_cast<std::size_t>(voxel)]);
    store_shared(there, static_cast<std::uint8_t>(total < most ? total : most));
  }
}

// --- All of it -----------------------------------------------------------------------------------

void BlockEditor::clear() noexcept {
  for (std::uint64_t octets = table_.octets_of(block_); octets != 0; octets &= octets - 1)
    update_observed(std::countr_zero(octets), TupleStore::Plane{});
  for (SlabHandle& page : block_.free_passes) {
    if (page == 0) continue;
    table_.pool_.release(kFreeSlab, page);
    store_shared(page, SlabHandle{0});
  }
}

/// The stamp stays odd until the block is opened anew.
void BlockEditor::close() noexcept {
  open_ = false;
  table_.index_.erase(BlockKey{block_.key}, [this](SlabHandle item) { return item == handle_; });
  clear();
  table_.leave_moving(handle_);
  table_.pool_.release(kBlockSlab, handle_);
}

}  // namespace tessera
