// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Answers of a network with their probabilities, summed up from several.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "simulator/label_noise.hpp"

namespace tessera::street {

/// Few answers are different; of more than kMostAnswers the later ones are left out.
class Mixture {
 public:
  void add(std::uint16_t id, double probability) noexcept {
    std::size_t at = 0;
    while (at < count_ && ids_[at] != id) ++at;
    if (at == ids_.size()) return;
    if (at == count_) ids_[count_++] = id;
    sums_[at] += probability;
  }
  void add(const Belief& belief, double share) noexcept {
    for (std::size_t i = 0; i < Belief::kLabels; ++i)
      add(belief.ids[i], share * static_cast<double>(belief.probabilities[i]));
  }
  /// The likeliest, but said first: it takes the likeliest one's probability if that is another.
  [[nodiscard]] Belief belief(std::uint16_t said) noexcept {
    Belief found;
    for (std::size_t i = 0; i < Belief::kLabels; ++i) {
      const auto most =
          static_cast<std::size_t>(std::max_element(sums_.begin(), sums_.end()) - sums_.begin());
      if (i == 0 && ids_[most] != said) {
        const auto its = static_cast<std::size_t>(
            std::find(ids_.begin(), ids_.begin() + static_cast<std::ptrdiff_t>(count_), said) -
            ids_.begin());
        if (its < count_) std::swap(sums_[its], sums_[most]);
        found.ids[0] = said;
        found.probabilities[0] = static_cast<float>(its < count_ ? sums_[its] : sums_[most]);
        sums_[its < count_ ? its : most] = 0.0;
        continue;
      }
      found.ids[i] = ids_[most];
      found.probabilities[i] = static_cast<float>(sums_[most]);
      sums_[most] = 0.0;
    }
    return found;
  }

 private:
  static constexpr std::size_t kMostAnswers = 12;
  std::array<std::uint16_t, kMostAnswers> ids_{};
  std::array<double, kMostAnswers> sums_{};
  std::size_t count_ = 0;
};

}  // namespace tessera::street
