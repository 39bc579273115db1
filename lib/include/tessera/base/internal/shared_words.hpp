// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory that one thread changes while others read it. Every store by the writer and every load by
// a reader is a relaxed atomic one, so that neither is undefined; what a reader got may be a
// mixture of before and after, and a stamp tells (Block::stamp, BlockIndex). The writer's own loads
// are plain ones: nobody else stores.
//
// Where words are of 32 bits, a number of 64 is stored and read by halves: the writer's lower half
// first, the reader's upper half first. A reader may get the upper half of before with the lower
// half of after, so of a number that grows never more than it is; of a stamp the lower half alone
// tells of any change.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "tessera/base/assert.hpp"

namespace tessera {

/// Half of a number of 64 bits, in its place.
using SharedHalf [[gnu::may_alias]] = std::uint32_t;
/// Which of two halves, by address, is the lower one.
inline constexpr std::size_t kLowerHalf = std::endian::native == std::endian::little ? 0 : 1;

/// A copy of what is at from. T: an unsigned integer of at most 64 bits. By halves, both are read
/// with acquire.
template <class T>
[[nodiscard]] T load_shared(const T& from,
                            std::memory_order order = std::memory_order_relaxed) noexcept {
  if constexpr (sizeof(T) <= sizeof(std::size_t)) {
    static_assert(std::atomic_ref<T>::is_always_lock_free);
    // A load changes nothing, but only C++26 has references to const.
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
    return std::atomic_ref<T>(const_cast<T&>(from)).load(order);
  } else {
    static_assert(sizeof(T) == 2 * sizeof(SharedHalf));
    const auto* const halves = reinterpret_cast<const SharedHalf*>(&from);
    const T upper = __atomic_load_n(halves + (1 - kLowerHalf), __ATOMIC_ACQUIRE);
    return upper << 32U | __atomic_load_n(halves + kLowerHalf, __ATOMIC_ACQUIRE);
  }
}

/// By halves, both are stored with release.
template <class T>
void store_shared(T& to, T value, std::memory_order order = std::memory_order_relaxed) noexcept {
  if constexpr (sizeof(T) <= sizeof(std::size_t)) {
    static_assert(std::atomic_ref<T>::is_always_lock_free);
    std::atomic_ref<T>(to).store(value, order);
  } else {
    static_assert(sizeof(T) == 2 * sizeof(SharedHalf));
    auto* const halves = reinterpret_cast<SharedHalf*>(&to);
    __atomic_store_n(halves + kLowerHalf, static_cast<SharedHalf>(value), __ATOMIC_RELEASE);
    __atomic_store_n(halves + (1 - kLowerHalf), static_cast<SharedHalf>(value >> 32U),
                     __ATOMIC_RELEASE);
  }
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
