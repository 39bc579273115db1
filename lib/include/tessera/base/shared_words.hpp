// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory that one thread changes while others read it. Every store by the writer and every load by
// a reader is a relaxed atomic one, so that neither is undefined; what a reader got may be a
// mixture of before and after, and a stamp tells (Block::stamp, BlockIndex). The writer's own loads
// are plain ones: nobody else stores.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "tessera/base/assert.hpp"

namespace tessera {

/// A copy of what is at from. T: an unsigned integer of at most 64 bits.
template <class T>
[[nodiscard]] T load_shared(const T& from,
                            std::memory_order order = std::memory_order_relaxed) noexcept {
  static_assert(std::atomic_ref<T>::is_always_lock_free);
  // A load changes nothing, but only C++26 has references to const.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
  return std::atomic_ref<T>(const_cast<T&>(from)).load(order);
}

template <class T>
void store_shared(T& to, T value, std::memory_order order = std::memory_order_relaxed) noexcept {
  static_assert(std::atomic_ref<T>::is_always_lock_free);
  std::atomic_ref<T>(to).store(value, order);
}

/// Copies out of memory that is shared, in words of eight bytes. bytes: a multiple of eight; from:
/// aligned to eight. O(bytes).
inline void load_shared_words(void* to, const void* from, std::size_t bytes) noexcept {
  TESSERA_ASSERT(bytes % 8 == 0 && reinterpret_cast<std::uintptr_t>(from) % 8 == 0);
  const auto* const words = static_cast<const std::uint64_t*>(from);
  for (std::size_t i = 0; i < bytes / 8; ++i) {
    const std::uint64_t word = load_shared(words[i]);
    std::memcpy(static_cast<std::byte*>(to) + 8 * i, &word, 8);
  }
}

/// Copies into memory that is shared; as load_shared_words, with the roles exchanged.
inline void store_shared_words(void* to, const void* from, std::size_t bytes) noexcept {
  TESSERA_ASSERT(bytes % 8 == 0 && reinterpret_cast<std::uintptr_t>(to) % 8 == 0);
  auto* const words = static_cast<std::uint64_t*>(to);
#pragma GCC unroll 16
  for (std::size_t i = 0; i < bytes / 8; ++i) {
    std::uint64_t word = 0;
    std::memcpy(&word, static_cast<const std::byte*>(from) + 8 * i, 8);
    store_shared(words[i], word);
  }
}

/// Zeros in memory that is shared. bytes: a multiple of sixteen.
inline void clear_shared_words(void* to, std::size_t bytes) noexcept {
  TESSERA_ASSERT(bytes % 16 == 0 && reinterpret_cast<std::uintptr_t>(to) % 8 == 0);
  auto* const words = static_cast<std::uint64_t*>(to);
  for (std::size_t i = 0; i < bytes / 8; i += 2) {
    store_shared(words[i], std::uint64_t{0});
    store_shared(words[i + 1], std::uint64_t{0});
  }
}

}  // namespace tessera
