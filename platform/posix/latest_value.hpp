// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A value that one thread sets again and again and others look at: each sees the latest one, whole.
// The writer never waits; a reader that meets it at work tries again, a bounded number of times.
#pragma once

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

  /// Until the first set(), get() gives a default Value.
  LatestValue() noexcept { store(Value{}); }

  void set(const Value& value) noexcept {
    // Odd while the words change. The fence keeps their stores behind that of the odd number.
    const std::uint64_t version = version_.load(std::memory_order_relaxed);
    version_.store(version + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    store(value);
    version_.store(version + 2, std::memory_order_release);
  }

  /// False, and into is unchanged, iff each of kMaxAttempts tries met the writer at work: it sets
  /// without a pause, or was interrupted in the middle. What was got before is then still the best.
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

  /// Values that were set.
  [[nodiscard]] std::uint64_t version() const noexcept {
    return version_.load(std::memory_order_acquire) / 2;
  }

 private:
  static constexpr std::size_t kWords = (sizeof(Value) + 7) / 8;
  using Words = std::array<std::uint64_t, kWords>;

  void store(const Value& value) noexcept {
    Words words{};
    std::memcpy(words.data(), static_cast<const void*>(&value), sizeof(Value));
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_relaxed);
  }

  std::atomic<std::uint64_t> version_{0};
  std::array<std::atomic<std::uint64_t>, kWords> words_{};
};

}  // namespace tessera
