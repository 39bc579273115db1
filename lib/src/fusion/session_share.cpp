// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/session_share.hpp"

#include <algorithm>
#include <bit>

namespace tessera {

Result<SessionShare> SessionShare::make(Arena& arena, int num_components,
                                        std::uint32_t contributions, float max_evidence,
                                        float free_weight) noexcept {
  SessionShare share;
  const Result<BlockContent> content = BlockContent::make(arena, num_components);
  const std::span<Voxels> voxels = arena.take<Voxels>(1);
  share.seen_ = arena.take<Seen>(contributions);
  if (!content.ok() || voxels.empty() || share.seen_.empty()) return Status::kResourceExhausted;
  share.content_ = *content;
  share.voxels_ = voxels.data();
  share.most_ = (max_evidence > 0.0F ? max_evidence : kEvidenceWithoutCap) * 0.25F;
  share.free_weight_ = free_weight;
  return share;
}

std::uint64_t SessionShare::begin(const MapSession& session) noexcept {
  if (!entered_) {
    content_.clear();
    voxels_->any.fill(0);
    voxels_->labels.fill(0.0F);
    entered_ = true;
  }
  voxels_->observed.fill(0);
  units_ = session.weight;
  weight_ = static_cast<float>(units_) * (1.0F / MapSession::kFullWeight);
  const std::span<Seen> known = seen_.first(seen_count_);
  const auto at = std::find_if(known.begin(), known.end(),
                               [&](const Seen& seen) { return seen.digest == session.digest; });
  now_ = at != known.end() ? &*at : &seen_[seen_count_++];
  if (at == known.end()) *now_ = {session.digest, {}};
  voxels_->hidden = now_->voxels;
  return seen_count_;
}

void SessionShare::end() noexcept {
  for (std::size_t i = 0; i < voxels_->observed.size(); ++i) {
    now_->voxels[i] |= voxels_->observed[i];
    voxels_->any[i] |= voxels_->observed[i];
  }
}

/// What all evidence of a voxel is multiplied by, so that it is no more than sessions may have.
float SessionShare::scale_of(int row, unsigned passes) const noexcept {
  const float evidence =
      voxels_->labels[static_cast<std::size_t>(row)] + free_weight_ * static_cast<float>(passes);
  return evidence > most_ ? most_ / evidence : 1.0F;
}

std::uint64_t SessionShare::end_block(BlockContent& sums, float omega, int last_class,
                                      bool& labelled) noexcept {
  if (!entered_) return 0;
  std::uint64_t work = 0;
  for (std::size_t word = 0; word < voxels_->any.size(); ++word) {
    for (std::uint64_t rows = voxels_->any[word]; rows != 0; rows &= rows - 1) {
      const int row = static_cast<int>(64 * word) + std::countr_zero(rows);
      const unsigned passes = content_.passes(row);
      const float scale = scale_of(row, passes);
      for (std::uint64_t rest = content_.components(); rest != 0; rest &= rest - 1, ++work) {
        const int component = std::countr_zero(rest);
        const float count = omega * (content_.count(component, row) * scale);
        if (count < kLeastCount) continue;
        sums.add(component, row, count);
        labelled = labelled || component <= last_class;
      }
      if (const float rest = omega * (content_.rest(row) * scale); rest >= kLeastCount)
        sums.add_rest(row, rest);
      // Rounded down, as where a map's cap scales them: in favour of what is occupied. The slack is
      // for products that are whole numbers but for rounding.
      const auto left = static_cast<unsigned>(static_cast<float>(passes) * scale + 0x1p-10F);
      if (left != 0) sums.add_passes(row, left);
      ++work;
    }
  }
  return work;
}

}  // namespace tessera
