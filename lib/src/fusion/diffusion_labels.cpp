// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which label a node has after the diffusion.
#include <bit>

#include "tessera/base/internal/bits.hpp"
#include "tessera/fusion/internal/diffusion_brick.hpp"

namespace tessera {

namespace {

/// What the classes behind lack of the one that is kept.
constexpr float kBehind = 1.0F / 16.0F;
/// As how much evidence a witness counts at most: what was seen often does not decide alone.
constexpr float kHeard = 2.0F;

/// Puts one class before all others: what is above a level goes to that class, which is then at
/// this level, too, and a bit higher. The sum stays. At least one class is ahead of it.
/// O(lanes * classes above the level).
void put_first(float* z, std::size_t first, std::size_t lanes) noexcept {
  std::uint64_t above = 0;
  float count = 0.0F;
  float sum = z[first];
  float level = sum;
  // The largest first: whatever rounding does to the level, each is taken once.
  for (;;) {
    std::size_t most = first;
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const bool is_left = lane != first && (above >> lane & 1U) == 0;
      if (is_left && (most == first || z[lane] > z[most])) most = lane;
    }
    if (most == first || (count > 0.0F && z[most] <= level)) break;
    above |= std::uint64_t{1} << most;
    count += 1.0F;
    sum += z[most];
    level = sum / (count + 1.0F);
  }
  z[first] = level * (1.0F + count * kBehind);
  for (; above != 0; above &= above - 1) z[std::countr_zero(above)] = level * (1.0F - kBehind);
}

}  // namespace

/// The nodes of a row from x on, a bit each; at most 64.
std::uint64_t DiffusionBrick::nodes_from(const Row& row, std::int32_t x) noexcept {
  const auto word = static_cast<std::size_t>(x) / 64;
  const auto shift = static_cast<unsigned>(x) % 64;
  const std::uint64_t here = row[word] >> shift;
  return shift == 0 || word + 1 == row.size() ? here : here | row[word + 1] << (64 - shift);
}

/// Whether two thirds of the evidence around a node are of other classes than the one of a lane,
/// and two fifths of the one in lane `by`; a witness counts up to kHeard. The second keeps poles
/// and signs before a mix of classes, of which none has so much. work: the voxels that were looked
/// at are added.
bool DiffusionBrick::is_outvoted(VoxelCoord v, std::size_t lane, std::size_t by,
                                 std::uint64_t& work) const noexcept {
  const std::size_t own_row = row_at(v.y, v.z);
  float same = 0.0F;
  float other = 0.0F;
  float all = 0.0F;
  for (const WitnessRow& row : witnesses_) {
    work += 2 * std::uint64_t{row.width} + 1;
    const std::size_t at = own_row + static_cast<std::size_t>(row.rows);
    const std::int32_t x = v.x - row.width;
    const std::uint64_t nodes = nodes_from(rows_[at], x) & row.mask;
    if (nodes == 0) continue;
    // Nodes of a row are numbered one after the other.
    std::size_t node = nodes_before(at, x);
    for (int count = count_ones(nodes); count != 0; --count, ++node) {
      const float sum = nodes_[node].sum;
      const float part = sum > kHeard ? kHeard / sum : 1.0F;
      same += part * sums_[node * stride_ + lane];
      other += part * sums_[node * stride_ + by];
      all += part * sum;
    }
  }
  return 3.0F * same <= all && 5.0F * other >= 2.0F * all;
}

/// Of a node of which another label than its own is ahead.
void DiffusionBrick::keep_label(std::size_t at, VoxelCoord v, std::uint64_t& work) noexcept {
  float* const z = result_ + at * stride_;
  if (!is_outvoted(v, labels_[at], nodes_[at].leader, work)) put_first(z, labels_[at], lanes_);
  float total = 0.0F;
  for (std::size_t lane = 0; lane < lanes_; ++lane) total += z[lane];
  const float scale = nodes_[at].sum / total;
  for (std::size_t lane = 0; lane < lanes_; ++lane) z[lane] *= scale;
}

DiffusionBrick::NodeResult DiffusionBrick::result(VoxelCoord node, std::uint64_t& work) noexcept {
  const std::size_t at = node_at(node);
  Node& here = nodes_[at];
  if (here.leader != labels_[at]) {
    keep_label(at, node - origin_, work);
    here.leader = labels_[at];
  }
  return {result_ + at * stride_, here.sum, here.change};
}

}  // namespace tessera
