// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which classes evidence is of, where that is known apart from how much of it there is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace tessera {

struct LabelShares {
  /// As many as a compact tuple keeps apart.
  static constexpr std::size_t kMost = 3;

  std::array<std::uint8_t, kMost> labels{};  ///< The largest share first, among equals the lower.
  std::array<float, kMost> shares{};         ///< Of one, together.
  std::size_t count = 0;                     ///< 0: nothing is known.

  /// Keeps a class if it is among the largest so far. Classes come in ascending order; shares may
  /// be of any sum, and are of one after divide().
  constexpr void offer(std::uint8_t label, float share) noexcept {
    if (!(share > 0.0F)) return;
    if (count < kMost) {
      labels[count] = label;
      shares[count++] = share;
    } else if (share > shares[kMost - 1]) {
      labels[kMost - 1] = label;
      shares[kMost - 1] = share;
    } else {
      return;
    }
    for (std::size_t i = count - 1; i > 0 && shares[i] > shares[i - 1]; --i) {
      std::swap(labels[i], labels[i - 1]);
      std::swap(shares[i], shares[i - 1]);
    }
  }
  /// Drops those under least times the largest, and makes the others of one.
  constexpr void divide(float least) noexcept {
    while (count > 1 && shares[count - 1] < least * shares[0]) --count;
    float sum = 0.0F;
    for (std::size_t i = 0; i < count; ++i) sum += shares[i];
    for (std::size_t i = 0; i < count; ++i) shares[i] /= sum;
  }
  /// All of its first class.
  [[nodiscard]] constexpr LabelShares first() const noexcept {
    return {.labels = {labels[0]}, .shares = {1.0F}, .count = 1};
  }
  [[nodiscard]] constexpr std::uint64_t components() const noexcept {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < count; ++i) bits |= std::uint64_t{1} << labels[i];
    return bits;
  }
};

}  // namespace tessera
