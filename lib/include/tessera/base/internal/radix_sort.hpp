// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A stable sort of 64-bit keys with a 32-bit payload: linear time, no heap, scratch from the
// caller.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/assert.hpp"

namespace tessera {

/// What is sorted: a key, and whose it is.
struct KeyedIndex {
  std::uint64_t key = 0;
  std::uint32_t index = 0;
};

/// Sorts items by key, equal keys in their first order. scratch: at least as long as items.
/// O(14 n) at worst: a pass that finds the bits in which the keys differ, two for each eleven of
/// them (at most six digits), and one that copies the result back. 8 kB of stack.
inline void radix_sort(std::span<KeyedIndex> items, std::span<KeyedIndex> scratch) noexcept {
  TESSERA_ASSERT(scratch.size() >= items.size());
  constexpr unsigned kDigitBits = 11;
  constexpr std::uint64_t kDigit = (std::uint64_t{1} << kDigitBits) - 1;
  std::uint64_t all_or = 0;
  std::uint64_t all_and = ~std::uint64_t{0};
  for (const KeyedIndex& item : items) {
    all_or |= item.key;
    all_and &= item.key;
  }
  std::uint64_t differing = items.empty() ? 0 : all_or ^ all_and;
  KeyedIndex* from = items.data();
  KeyedIndex* to = scratch.data();
  while (differing != 0) {
    const auto shift = static_cast<unsigned>(std::countr_zero(differing));
    differing &= ~(kDigit << shift);
    std::array<std::uint32_t, kDigit + 1> start{};
    for (std::size_t i = 0; i < items.size(); ++i) ++start[(from[i].key >> shift) & kDigit];
    std::uint32_t sum = 0;
    for (std::uint32_t& entry : start) {
      const std::uint32_t count = entry;
      entry = sum;
      sum += count;
    }
    for (std::size_t i = 0; i < items.size(); ++i) {
      to[start[(from[i].key >> shift) & kDigit]++] = from[i];
    }
    KeyedIndex* const swap = from;
    from = to;
    to = swap;
  }
  if (from != items.data()) {
    for (std::size_t i = 0; i < items.size(); ++i) items[i] = from[i];
  }
}

}  // namespace tessera
