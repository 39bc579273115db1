// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/robot_share.hpp"

namespace tessera {

Result<RobotShare> RobotShare::make(Arena& arena, int num_components, std::uint32_t contributions,
                                    float max_evidence, float free_weight) noexcept {
  RobotShare share;
  const Result<BlockContent> before = BlockContent::make(arena, num_components);
  const std::span<Voxels> voxels = arena.take<Voxels>(1);
  share.seen_ = arena.take<Seen>(contributions);
  if (!before.ok() || voxels.empty() || share.seen_.empty()) return Status::kResourceExhausted;
  share.before_ = *before;
  share.voxels_ = voxels.data();
  share.cap_ = max_evidence > 0.0F ? max_evidence : kEvidenceWithoutCap;
  // Without a cap a map's own bound is what a byte holds, and the weight of a pass may be anything.
  const unsigned passes = passes_at_cap(share.cap_, free_weight);
  share.passes_ = passes != 0 ? passes : 1;
  return share;
}

void RobotShare::take_over(const BlockContent& sums) noexcept {
  before_.assign(sums);
  voxels_->newer.fill(0);
  voxels_->observed.fill(0);
  voxels_->labels.fill(0.0F);
  voxels_->passes.fill(0);
  entered_ = true;
}

std::uint64_t RobotShare::begin_submap(std::uint32_t submap) noexcept {
  if (!entered_) return 0;  // then nothing was seen
  voxels_->newer.fill(0);
  voxels_->observed.fill(0);
  for (const Seen& seen : seen_.first(newer_count_)) {
    if (seen.submap != submap) continue;
    for (std::size_t i = 0; i < seen.voxels.size(); ++i) voxels_->newer[i] |= seen.voxels[i];
  }
  return newer_count_;
}

void RobotShare::end_submap(std::uint32_t submap) noexcept {
  if (!entered_) return;
  std::uint64_t any = 0;
  for (const std::uint64_t word : voxels_->observed) any |= word;
  if (any != 0) seen_[seen_count_++] = {submap, voxels_->observed};
}

/// Mostly none is: so without branches.
bool RobotShare::any_too_full() const noexcept {
  const float labels = most_labels();
  const unsigned passes = most_passes();
  unsigned found = 0;
  for (const float sum : voxels_->labels) found |= sum > labels ? 1U : 0U;
  for (const std::uint32_t sum : voxels_->passes) found |= sum > passes ? 1U : 0U;
  return found != 0;
}

/// As a local map's cap: all components in proportion.
std::uint64_t RobotShare::scale_labels(int row, BlockContent& sums) const noexcept {
  const float scale = cap_ / voxels_->labels[static_cast<std::size_t>(row)];
  std::uint64_t work = 0;
  const auto scaled = [&](float with, float without) { return without + (with - without) * scale; };
  for (std::uint64_t rest = sums.components(); rest != 0; rest &= rest - 1, ++work) {
    const int component = std::countr_zero(rest);
    const float with = sums.count(component, row);
    if (with > 0.0F) sums.set(component, row, scaled(with, before_.count(component, row)));
  }
  if (sums.any_rest()) sums.set_rest(row, scaled(sums.rest(row), before_.rest(row)));
  return work;
}

std::uint64_t RobotShare::end_robot(BlockContent& sums) noexcept {
  if (!entered_) return 0;
  std::uint64_t work = 1;
  if (!any_too_full()) return work;
  for (int row = 0; row < kBlockVoxels; ++row) {
    const auto at = static_cast<std::size_t>(row);
    if (voxels_->labels[at] > most_labels()) work += scale_labels(row, sums);
    if (voxels_->passes[at] > most_passes()) {
      sums.set_passes(row, static_cast<std::uint16_t>(before_.passes(row)));
      sums.add_passes(row, passes_);
    }
  }
  return work;
}

}  // namespace tessera
