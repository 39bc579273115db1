// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Counters that one thread updates and others read: a copy that the owner renews, word by word.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace tessera {

/// Report: a struct of 64-bit numbers. One thread calls store(), any load(). Each number is from
/// some store(); all are of about the same moment.
template <class Report>
class SharedReport {
 public:
  void store(const Report& report) noexcept {
    const Words words = std::bit_cast<Words>(report);
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_relaxed);
  }
  [[nodiscard]] Report load() const noexcept {
    Words words{};
    for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_relaxed);
    return std::bit_cast<Report>(words);
  }

 private:
  static_assert(std::is_trivially_copyable_v<Report> && sizeof(Report) % 8 == 0);
  static constexpr std::size_t kWords = sizeof(Report) / 8;
  using Words = std::array<std::uint64_t, kWords>;

  std::array<std::atomic<std::uint64_t>, kWords> words_{};
};

}  // namespace tessera
