// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A value that one thread sets repeatedly and others read: each sees the latest one, consistently.
// The writer never waits; a reader that overlaps with it tries again, a bounded number of times.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace tessera {

/// One thread calls set(); get() and version() are for any. No locks, system calls or heap; both
/// cost a copy of the value.
template <class Value>
class LatestValue {
 public:
  static_assert(std::is_trivially_copyable_v<Value>);
  static constexpr int kMaxAttempts = 1000;

  /// Until the first set(), get() returns a default Value.
  LatestValue() noexcept { store(Value{}); }

  void set(const Value& value) noexcept {
    // Odd while the words change. The fence keeps their stores after that of the odd number.
    const std::uint64_t version = version_.load(std::memory_order_relaxed);
    version_.store(version + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    store(value);
    version_.store(version + 2, std::memory_order_release);
  }

  /// False, and into is unchanged, iff each of kMaxAttempts tries overlapped with the writer, which
  /// sets without a pause, or was interrupted. The previous value is then still the best.
  [[nodiscard]] bool get(Value& into) const noexcept {
    Words words;
    for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
      const std::uint64_t before = version_.load(std::memory_order_acquire);
      if (before % 2 != 0) continue;
      for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      if (version_.load(std::memory_order_relaxed) != before) continue;
      std::memcpy(static_cast<void*>(&into), words.data(), sizeof(Value));
      return true;
    }
    return false;
  }

  /// Number of calls of set().
  [[nodiscard]] std::uint64_t version() const noexcept {
    return version_.load(std::memory_order_acquire) / 2;
  }

 private:
  static constexpr std::size_t kWords = (sizeof(Value) + 7) / 8;
  using Words = std::array<std::uint64_t, kWords>;

  /// Word by word, as values can be larger than the writer's stack has room for.
  void store(const Value& value) noexcept {
    const auto* const bytes = reinterpret_cast<const std::byte*>(&value);
    for (std::size_t i = 0; i < kWords; ++i) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes + 8 * i, std::min<std::size_t>(8, sizeof(Value) - 8 * i));
      words_[i].store(word, std::memory_order_relaxed);
    }
  }

  std::atomic<std::uint64_t> version_{0};
  std::array<std::atomic<std::uint64_t>, kWords> words_{};
};

}  // namespace tessera
