// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Counts durations in buckets whose width grows with them, so that quantiles of any number of them
// need fixed memory.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tessera {

class DurationHistogram {
 public:
  /// us: under 0 counts as 0, over 2^40 as that. O(1).
  void add(std::int64_t us) noexcept {
    const auto value = static_cast<std::uint64_t>(std::clamp<std::int64_t>(us, 0, kMost));
    ++counts_[bucket_of(value)];
    ++count_;
    max_us_ = std::max(max_us_, static_cast<std::int64_t>(value));
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] std::int64_t max_us() const noexcept { return max_us_; }
  /// The least duration that a share of all does not exceed, up to 3 % too large; 0 without any.
  /// share: 0 to 1. O(buckets).
  [[nodiscard]] std::int64_t quantile_us(double share) const noexcept {
    const auto wanted = static_cast<std::uint64_t>(share * static_cast<double>(count_));
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      sum += counts_[i];
      if (sum > wanted) return std::min(max_us_, last_of(i));
    }
    return max_us_;
  }
  /// Calls visit(most_us, count) for each bucket that is not empty, shortest first: count durations
  /// of up to most_us. O(buckets).
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      if (counts_[i] != 0) visit(last_of(i), counts_[i]);
    }
  }
  void clear() noexcept { *this = {}; }

 private:
  static constexpr int kBits = 6;  ///< Bits that are distinguished below the highest.
  static constexpr std::uint64_t kExact = std::uint64_t{1} << kBits;
  static constexpr std::int64_t kMost = std::int64_t{1} << 40;
  static constexpr std::size_t kHalf = kExact / 2;

  [[nodiscard]] static constexpr std::size_t bucket_of(std::uint64_t us) noexcept {
    if (us < kExact) return us;
    const auto shift = static_cast<unsigned>(std::bit_width(us) - kBits);
    return kHalf + shift * kHalf + ((us >> shift) - kHalf);
  }
  [[nodiscard]] static constexpr std::int64_t last_of(std::size_t bucket) noexcept {
    if (bucket < kExact) return static_cast<std::int64_t>(bucket);
    const std::size_t shift = bucket / kHalf - 1;
    return static_cast<std::int64_t>(((bucket % kHalf + kHalf + 1) << shift) - 1);
  }

  std::array<std::uint64_t, kHalf * 38> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t max_us_ = 0;
};

}  // namespace tessera
