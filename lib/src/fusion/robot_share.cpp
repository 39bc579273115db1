// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/robot_share.hpp"

namespace tessera {

Result<RobotShare> RobotShare::make(Arena& arena, int num_components, std::uint32_t contributions,
                                    float max_evidence, float free_weight) noexcept {
  RobotShare share;
  const Result<BlockContent> content = BlockContent::make(arena, num_components);
  const std::span<Voxels> voxels = arena.take<Voxels>(1);
  share.seen_ = arena.take<Seen>(contributions);
  if (!content.ok() || voxels.empty() || share.seen_.empty()) return Status::kResourceExhausted;
  share.content_ = *content;
  share.voxels_ = voxels.data();
  share.cap_ = max_evidence > 0.0F ? max_evidence : kEvidenceWithoutCap;
  // Without a cap a map's own bound is what a byte holds, and the weight of a pass may be anything.
  const unsigned passes = passes_at_cap(share.cap_, free_weight);
  share.passes_ = passes != 0 ? passes : 1;
  return share;
}

void RobotShare::clear() noexcept {
  content_.clear();
  voxels_->newer.fill(0);
  voxels_->observed.fill(0);
  voxels_->labels.fill(0.0F);
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
  for (int row = 0; row < kBlockVoxels; ++row) found |= content_.passes(row) > passes ? 1U : 0U;
  return found != 0;
}

/// As a local map's cap: all components in proportion.
std::uint64_t RobotShare::scale_labels(int row) noexcept {
  const float scale = cap_ / voxels_->labels[static_cast<std::size_t>(row)];
  std::uint64_t work = 0;
  for (std::uint64_t rest = content_.components(); rest != 0; rest &= rest - 1, ++work) {
    const int component = std::countr_zero(rest);
    const float count = content_.count(component, row);
    if (count > 0.0F) content_.set(component, row, count * scale);
  }
  if (content_.any_rest()) content_.set_rest(row, content_.rest(row) * scale);
  return work;
}

std::uint64_t RobotShare::end_robot() noexcept {
  if (!entered_) return 0;
  std::uint64_t work = 1;
  if (!any_too_full()) return work;
  for (int row = 0; row < kBlockVoxels; ++row) {
    if (voxels_->labels[static_cast<std::size_t>(row)] > most_labels()) work += scale_labels(row);
    if (content_.passes(row) > most_passes())
      content_.set_passes(row, static_cast<std::uint16_t>(passes_));
  }
  return work;
}

}  // namespace tessera
