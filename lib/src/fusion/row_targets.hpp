// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the voxels of a contribution in a turned frame go.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "tessera/fusion/internal/block_sums.hpp"

namespace tessera {

/// Which bytes of a word have a value, a bit each.
[[nodiscard]] constexpr unsigned bytes_that_are(std::uint8_t value, std::uint64_t word) noexcept {
  constexpr std::uint64_t kLow = 0x7f7f7f7f7f7f7f7fU;
  const std::uint64_t differ = word ^ (value * 0x0101010101010101U);
  const std::uint64_t are = ~(((differ & kLow) + kLow) | differ | kLow);
  return static_cast<unsigned>(((are >> 7U) * 0x0102040810204080U) >> 56U);
}

/// The voxels of one block that a voxel of a local block goes to, without hidden ones. In a turned
/// frame each voxel of the block takes one local voxel, which is looked up once for all; what no
/// voxel takes goes to the one that contains its centre. What has a centroid goes to where the
/// corners of its box are, and a little to those that take it, so that no hole is left.
class BlockSums::RowTargets {
 public:
  struct Target {
    int row = 0;
    float part = 1.0F;   ///< Of the labels.
    float share = 0.0F;  ///< Of the box.
    bool takes = true;   ///< Free passes go to it.
  };

  RowTargets(BlockSums& sums, const VoxelMask& hidden, const GridTransform& T_global_local,
             BlockCoord local, BlockCoord global) noexcept
      : sums_(sums),
        hidden_(hidden),
        frame_(T_global_local),
        local_(local),
        global_(global),
        box_(T_global_local.local_box(global)) {
    if (frame_.shift_only()) return;
    near_ = voxels_within(local_, box_.first, box_.last);
    std::fill(sums_.first_.begin(), sums_.first_.end(), kNone);
    const std::uint8_t place = BlockSums::place_in(block_of(box_.first), local);
    for (std::size_t end = sums_.taken_in_.size(); end != 0; end -= 16) {
      // From the last one on, so that the first one that takes a voxel is the first of its list.
      for (unsigned rows = rows_of(place, end - 16); rows != 0;) {
        const auto bit = static_cast<unsigned>(std::bit_width(rows)) - 1U;
        rows &= ~(1U << bit);
        add_taker(end - 16 + bit);
      }
    }
  }
  /// layers: others have no targets from now on.
  void set_layers(unsigned layers) noexcept { layers_ = layers; }
  [[nodiscard]] std::span<const Target> of(int row, Centroid centroid) noexcept {
    count_ = 0;
    if (((layers_ >> layer_of_row(row)) & 1U) != 0) find(row, centroid);
    return std::span(targets_).first(count_);
  }

 private:
  static constexpr std::int16_t kNone = -1;
  static constexpr float kOfCorner = 1.0F / GridTransform::kBoxCorners;
  /// Of the labels, to each voxel whose centre is in one with a centroid, and that no corner of
  /// its box is in.
  static constexpr float kToTakers = 0.125F;

  /// Which of sixteen rows take a voxel of the block at a place, a bit each.
  [[nodiscard]] unsigned rows_of(std::uint8_t place, std::size_t first) const noexcept {
    unsigned rows = 0;
    for (std::size_t i = 0; i < 16; i += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, &sums_.taken_in_[first + i], sizeof(word));
      rows |= bytes_that_are(place, word) << i;
    }
    return rows;
  }
  void add_taker(std::size_t row) noexcept {
    std::int16_t& first = sums_.first_[static_cast<std::size_t>(row_order(sums_.taken_[row]))];
    sums_.next_[row] = first;
    first = static_cast<std::int16_t>(row);
  }
  void find(int row, Centroid centroid) noexcept {
    const VoxelCoord local = voxel_of_row(local_, row);
    if (frame_.shift_only()) return frame_.for_targets(local, [this](VoxelCoord to) { take(to); });
    // Mostly it is not. What is taken from here is in the box, too.
    if (!has_row(near_, row)) return;
    for (std::int16_t taker = sums_.first_[static_cast<std::size_t>(row)]; taker != kNone;
         taker = sums_.next_[static_cast<std::size_t>(taker)])
      add(taker);
    const bool is_taken = count_ != 0;
    if (!is_taken) find_untaken(local);
    if (!centroid.known()) return;
    for (std::size_t i = 0; i < count_; ++i) targets_[i].part = 0.0F;
    frame_.for_box_corners(local, centroid, [this](VoxelCoord to) { add_corner(to); });
    for (std::size_t i = 0; is_taken && i < count_; ++i) {
      if (targets_[i].part == 0.0F) targets_[i].part = kToTakers;
    }
  }
  /// Nothing in this block takes it. If its centre is in another block it is none of this one's.
  void find_untaken(VoxelCoord local) noexcept {
    const std::array<double, 3> center = frame_.to_global(local);
    const VoxelCoord own{floor_to_int(center[0]), floor_to_int(center[1]), floor_to_int(center[2])};
    if (block_of(own) != global_) return;
    frame_.for_targets(local, center, [this](VoxelCoord to) { take(to); });
  }
  void take(VoxelCoord to) noexcept {
    if (block_of(to) == global_) add(row_order(to));
  }
  void add(int row) noexcept {
    if (!has_row(hidden_, row)) targets_[count_++] = {.row = row};
  }
  void add_corner(VoxelCoord to) noexcept {
    if (block_of(to) != global_) return;
    const int row = row_order(to);
    std::size_t at = 0;
    while (at < count_ && targets_[at].row != row) ++at;
    if (at == count_) {
      if (has_row(hidden_, row)) return;
      targets_[count_++] = {.row = row, .part = 0.0F, .share = 0.0F, .takes = false};
    }
    targets_[at].part += kOfCorner;
    targets_[at].share += kOfCorner;
  }

  BlockSums& sums_;
  const VoxelMask& hidden_;
  const GridTransform& frame_;
  BlockCoord local_;
  BlockCoord global_;
  GridTransform::VoxelBox box_;
  VoxelMask near_{};  ///< Voxels of the local block in the box.
  unsigned layers_ = 0;
  std::size_t count_ = 0;
  std::array<Target, 8 + GridTransform::kBoxCorners> targets_{};
};

}  // namespace tessera
