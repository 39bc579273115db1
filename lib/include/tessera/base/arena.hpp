// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The one place memory comes from: a block of bytes given by the caller, handed out front to back
// and never returned.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>

#include "tessera/base/assert.hpp"

namespace tessera {

/// What every region taken from an arena is aligned to: a cache line.
inline constexpr std::size_t kArenaAlignment = 64;

constexpr std::size_t align_up(std::size_t bytes, std::size_t alignment) noexcept {
  return (bytes + alignment - 1) / alignment * alignment;
}

/// Bytes that taking count objects of T uses: for the constexpr size formulas, which must agree
/// with take().
template <class T>
constexpr std::size_t arena_bytes(std::size_t count) noexcept {
  return align_up(count * sizeof(T), kArenaAlignment);
}

/// Hands out regions of the caller's memory, which must be aligned to kArenaAlignment and outlive
/// everything made in it.
class Arena {
 public:
  explicit Arena(std::span<std::byte> memory) noexcept : memory_(memory) {}

  /// True iff the memory handed in is aligned as required.
  [[nodiscard]] bool aligned() const noexcept {
    return reinterpret_cast<std::uintptr_t>(memory_.data()) % kArenaAlignment == 0;
  }
  [[nodiscard]] std::size_t remaining_bytes() const noexcept { return memory_.size() - used_; }

  /// Takes count value-initialised objects of T (zeroed for numbers); an empty span if they do not
  /// fit. O(count).
  template <class T>
  [[nodiscard]] std::span<T> take(std::size_t count) noexcept {
    static_assert(std::is_trivially_destructible_v<T>, "an arena never runs destructors");
    T* const first = static_cast<T*>(take_raw(count, sizeof(T)));
    if (first == nullptr) return {};
    for (std::size_t i = 0; i < count; ++i) ::new (static_cast<void*>(first + i)) T{};
    return {first, count};
  }

  /// Takes bytes without touching them, so that pages the operating system has not yet given stay
  /// ungiven. O(1).
  [[nodiscard]] std::span<std::byte> take_untouched(std::size_t bytes) noexcept {
    auto* const first = static_cast<std::byte*>(take_raw(bytes, 1));
    return first == nullptr ? std::span<std::byte>{} : std::span<std::byte>{first, bytes};
  }

 private:
  void* take_raw(std::size_t count, std::size_t size) noexcept {
    if (count > remaining_bytes() / size) return nullptr;
    const std::size_t bytes = align_up(count * size, kArenaAlignment);
    if (bytes > remaining_bytes()) return nullptr;
    std::byte* const first = memory_.data() + used_;
    used_ += bytes;
    return first;
  }

  std::span<std::byte> memory_;
  std::size_t used_ = 0;
};

}  // namespace tessera
