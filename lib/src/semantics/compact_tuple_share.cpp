// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>

#include "octet_loops.hpp"
#include "tessera/base/internal/shared_words.hpp"
#include "tessera/semantics/internal/compact_tuple.hpp"

namespace tessera {

void CompactTuple::share_voxel(Octet& octet, std::size_t v, const LabelShares& shares,
                               std::uint32_t unlabelled) noexcept {
  std::uint32_t sum = 0;
  std::uint32_t of_no_class = 0;
  for (std::size_t s = 0; s < kSlots; ++s) {
    const std::uint32_t word = octet.words[s][v];
    if (word >> kCountBits == unlabelled)
      of_no_class = word;
    else
      sum += word & kMostCount;
  }
  if (sum == 0) return;
  const std::size_t free_slots = kSlots - (of_no_class != 0 ? 1 : 0);
  std::array<std::uint32_t, kSlots> words{};
  std::uint32_t left = sum;
  for (std::size_t i = 1; i < shares.count && i < free_slots; ++i) {
    const std::uint32_t count = part_of(sum, shares.shares[i]);
    words[i] = count == 0 ? 0 : std::uint32_t{shares.labels[i]} << kCountBits | count;
    left -= count;
  }
  words[0] =
      std::uint32_t{shares.labels[0]} << kCountBits | (left < kMostCount ? left : kMostCount);
  if (of_no_class != 0) words[kSlots - 1] = of_no_class;
  for (std::size_t s = 0; s < kSlots; ++s) octet.words[s][v] = words[s];
}

void CompactTuple::share_voxels(Octet& octet, const Plane* plane, unsigned voxels,
                                const LabelShares& shares, Words& given) const noexcept {
  OctetLoops::Shares of;
  of.voxels = voxels;
  for (std::size_t i = 0; i < kSlots; ++i) {
    of.labels[i] = shares.labels[i];
    of.shares[i] = i < shares.count ? shares.shares[i] : 0.0F;
  }
  loops_->share_out(octet.words[0].data(), plane == nullptr ? nullptr : plane->data(), quanta_, of,
                    given.data());
}

CompactTuple::Plane CompactTuple::add_shared(std::byte* octet_bytes, const OctetEvidence& added,
                                             unsigned voxels, const LabelShares& shares,
                                             int unlabelled) const noexcept {
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  const bool adds_unlabelled =
      ((added.components() >> static_cast<unsigned>(unlabelled)) & 1U) != 0;
  const bool adds_class = ((added.components() >> unsigned{shares.labels[0]}) & 1U) != 0;
  if (adds_unlabelled || !adds_class ||
      loops_->any_of(octet.words[0].data(), static_cast<std::uint32_t>(unlabelled))) {
    share(octet_bytes, voxels, shares.first(), unlabelled);
    static_cast<void>(add(octet_bytes, added));
    if (shares.count > 1) share(octet_bytes, voxels, shares, unlabelled);
    return label_sums(octet_bytes);
  }
  Words given{};
  if (added.has_rest())
    loops_->add_to_rests(octet.words[0].data(), added.read(0).data(), quanta_, given.data());
  share_voxels(octet, &added.read(shares.labels[0]), voxels, shares, given);
  join_centroids(octet, added.centroids(), given);
  store_shared_words(octet_bytes, &octet, sizeof(octet));
  return sums_of(octet);
}

void CompactTuple::share(std::byte* octet_bytes, unsigned voxels, const LabelShares& shares,
                         int unlabelled) const noexcept {
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  const auto no_class = static_cast<std::uint32_t>(unlabelled);
  if (!loops_->any_of(octet.words[0].data(), no_class)) {
    Words given{};
    share_voxels(octet, nullptr, voxels, shares, given);
  } else {
    for (unsigned rest = voxels; rest != 0; rest &= rest - 1)
      share_voxel(octet, static_cast<std::size_t>(std::countr_zero(rest)), shares, no_class);
  }
  store_shared_words(octet_bytes, &octet, sizeof(octet));
}

}  // namespace tessera
