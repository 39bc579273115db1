// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>

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

/// Loops over eight voxels without a branch, for the compiler's vectors. sums: of the slots, none
/// of which is of unlabelled evidence.
void CompactTuple::share_voxels(Octet& octet, unsigned voxels, const LabelShares& shares,
                                const Words& sums) noexcept {
  Words given{};  // all ones
  for (std::size_t v = 0; v < kOctetVoxels; ++v)
    given[v] = ((voxels >> v) & 1U) != 0 && sums[v] != 0 ? ~std::uint32_t{0} : 0;
  Words left = sums;
  for (std::size_t i = 1; i < kSlots; ++i) {
    const float share = i < shares.count ? shares.shares[i] : 0.0F;
    const std::uint32_t label = std::uint32_t{shares.labels[i]} << kCountBits;
    for (std::size_t v = 0; v < kOctetVoxels; ++v) {
      const std::uint32_t count = part_of(sums[v], share);
      const std::uint32_t word = count == 0 ? 0 : label | count;
      left[v] -= count;
      octet.words[i][v] = (word & given[v]) | (octet.words[i][v] & ~given[v]);
    }
  }
  const std::uint32_t first = std::uint32_t{shares.labels[0]} << kCountBits;
  for (std::size_t v = 0; v < kOctetVoxels; ++v) {
    const std::uint32_t word = first | (left[v] < kMostCount ? left[v] : kMostCount);
    octet.words[0][v] = (word & given[v]) | (octet.words[0][v] & ~given[v]);
  }
}

void CompactTuple::share(std::byte* octet_bytes, unsigned voxels, const LabelShares& shares,
                         int unlabelled) noexcept {
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  const auto no_class = static_cast<std::uint32_t>(unlabelled);
  std::uint32_t any_of_no_class = 0;
  Words sums{};
  for (std::size_t s = 0; s < kSlots; ++s) {
    for (std::size_t v = 0; v < kOctetVoxels; ++v) {
      const std::uint32_t word = octet.words[s][v];
      any_of_no_class |= word >> kCountBits == no_class ? 1U : 0U;
      sums[v] += word & kMostCount;
    }
  }
  if (any_of_no_class == 0) {
    share_voxels(octet, voxels, shares, sums);
  } else {
    for (unsigned rest = voxels; rest != 0; rest &= rest - 1)
      share_voxel(octet, static_cast<std::size_t>(std::countr_zero(rest)), shares, no_class);
  }
  store_shared_words(octet_bytes, &octet, sizeof(octet));
}

}  // namespace tessera
