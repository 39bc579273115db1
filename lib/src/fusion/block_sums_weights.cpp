// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What of a robot's labels counts.
#include <algorithm>
#include <bit>

#include "tessera/fusion/internal/block_sums.hpp"

namespace tessera {

/// What was gathered, by what a count of each class counts.
void BlockSums::add_robot(const RobotWeights& weights, unsigned robot_bit,
                          BlockContent& content) noexcept {
  if (!share_.entered()) return;
  const BlockContent& own = share_.content();
  opinions_.add(robot_bit, own);
  const std::span<const float> of_classes = weights.weights(robot_bit);
  const bool all_one = weights.all_one(robot_bit);
  if (all_one && omega_ == 1.0F && content.is_untouched()) return share_.swap_content(content);
  for (std::size_t c = 0; c < factors_.size(); ++c)
    factors_[c] = all_one ? omega_ : omega_ * of_classes[c];
  content.add(own, factors_);
  if (all_one) return;
  if (!any_doubted_) std::fill(doubted_.begin(), doubted_.end(), 0.0F);
  any_doubted_ = true;
  for (std::uint64_t rest = own.components(); rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const float doubt = omega_ - factors_[static_cast<std::size_t>(component)];
    for (int row = 0; row < kBlockVoxels && doubt > 0.0F; ++row)
      doubted_[static_cast<std::size_t>(row)] += doubt * own.count(component, row);
  }
}

/// That something is there is not doubted: label evidence that does not count as its class is of
/// no known class.
void BlockSums::add_doubted(BlockContent& content) const noexcept {
  for (int row = 0; row < kBlockVoxels; ++row) {
    const float doubted = doubted_[static_cast<std::size_t>(row)];
    if (doubted >= kLeastCount) content.add(last_class_ + 1, row, doubted);
  }
}

}  // namespace tessera
