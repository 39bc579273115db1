// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A ray through the grid, a slab of voxels at a time along the axis on which it is longest. In a
// slab it crosses at most one voxel border on each other axis, so it marks one to three voxels, all
// of them in one word of a bitmap whose words run along that axis: no step waits for the one
// before it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "tessera/base/geometry.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {

/// The two axes across axis, in ascending order.
[[nodiscard]] constexpr std::array<int, 2> axes_across(int axis) noexcept {
  return {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
}

/// Fixed-point coordinates: 2^-38 of a voxel, over the whole grid in 62 bits.
class SlabWalk {
 public:
  /// From a to b, or to the part of it (0 .. 1]; both in voxels and in the grid. The voxels of a
  /// part are among those of the whole, to the bit.
  SlabWalk(const Point3d& a, const Point3d& b, double part) noexcept;

  /// The axis on which |d| is largest; ties to x, then y.
  [[nodiscard]] static int longest_axis(const Point3d& d) noexcept {
    const Point3d size = d.cwiseAbs();
    const int axis = size.y() > size.x() ? 1 : 0;
    return size.z() > size[axis] ? 2 : axis;
  }
  /// The axis whose slabs the walk goes through.
  [[nodiscard]] int axis() const noexcept { return axis_; }
  /// Voxels that the ray crosses. At most |dx| + |dy| + |dz| + 4, in voxels.
  [[nodiscard]] std::uint64_t voxels() const noexcept;

  /// Walks. words_of(block) gives the eight words of a block's bitmap: word a & 7, bit
  /// (b & 7) + 8 (c & 7) for the voxel at a on the walk's axis and b, c on the axes across; null
  /// ends the walk, and false is returned. Sets every voxel's bit. Asks for a block whenever the
  /// walk enters it, some of them twice in a row; with kAllCorners also for those that a part of
  /// this ray could enter in place of another where two borders meet.
  template <bool kAllCorners, class WordsOf>
  bool walk(WordsOf&& words_of) const noexcept;

 private:
  static constexpr int kFraction = 38;
  static constexpr std::int64_t kOne = std::int64_t{1} << kFraction;
  static constexpr std::int64_t kBlock = kBlockEdge * kOne;

  /// Floor: which voxel of its axis v lies in.
  [[nodiscard]] static std::int32_t cell(std::int64_t v) noexcept {
    return static_cast<std::int32_t>(v >> kFraction);
  }
  /// The walk's coordinate on one of the axes across.
  struct Across {
    std::int64_t start = 0;
    std::int64_t first = 0;  ///< Where the first slab ends.
    std::int64_t step = 0;   ///< A slab; at most one voxel.
    std::int64_t end = 0;
  };
  template <bool kAllCorners, class WordsOf>
  class Place;

  int axis_ = 0;
  std::int32_t direction_ = 1;
  std::int32_t from_ = 0;   ///< The first slab.
  std::int32_t slabs_ = 0;  ///< Slabs beyond it.
  std::array<Across, 2> across_{};
};

/// Where a walk has come to. Coordinates across are relative to the block.
template <bool kAllCorners, class WordsOf>
class SlabWalk::Place {
 public:
  Place(const SlabWalk& walk, WordsOf& words_of) noexcept
      : walk_(walk),
        words_of_(words_of),
        a_(walk.from_),
        b_block_(cell(walk.across_[0].start) >> 3),
        c_block_(cell(walk.across_[1].start) >> 3),
        b_(walk.across_[0].start - b_block_ * kBlock),
        c_(walk.across_[1].start - c_block_ * kBlock),
        words_(words_at(0, 0)) {}

  [[nodiscard]] bool stopped() const noexcept { return words_ == nullptr; }

  /// Marks what the ray crosses in this slab on its way to (b, c), absolute.
  void cross_to(std::int64_t b, std::int64_t c) noexcept {
    cross(b - b_block_ * kBlock, c - c_block_ * kBlock);
  }
  /// Enters the next slab.
  void enter_next() noexcept {
    const std::int32_t before = a_ >> 3;
    a_ += walk_.direction_;
    if ((a_ >> 3) != before) words_ = words_at(0, 0);
  }
  /// Crosses up to `slabs` slabs and enters the one behind them, up to the block's end along the
  /// walk or a slab that needs more care: one where it leaves the block sideways, or crosses two
  /// borders. Returns how many.
  std::int32_t cross_plain_slabs(std::int32_t slabs) noexcept {
    const std::int64_t b_step = walk_.across_[0].step;
    const std::int64_t c_step = walk_.across_[1].step;
    const std::int32_t direction = walk_.direction_;
    const std::int32_t first = a_ & 7;
    const std::int32_t in_block = direction > 0 ? kBlockEdge - first : first + 1;
    const std::int32_t most = slabs < in_block ? slabs : in_block;
    std::int64_t b = b_;
    std::int64_t c = c_;
    std::uint64_t* word = words_ + first;
    unsigned at = index_of(b, c);
    std::uint64_t here = kOneBit << at;
    std::int32_t done = 0;
    for (; done < most; ++done) {
      const std::int64_t b_next = b + b_step;
      const std::int64_t c_next = c + c_step;
      if (outside(b_next | c_next)) break;
      const unsigned to = index_of(b_next, c_next);
      if (((kBothTurn >> (at ^ to)) & 1U) != 0) break;
      const std::uint64_t there = kOneBit << to;
      *word |= here | there;
      word += direction;
      at = to;
      here = there;
      b = b_next;
      c = c_next;
    }
    b_ = b;
    c_ = c;
    a_ += done * direction;
    if (done == in_block) words_ = words_at(0, 0);
    return done;
  }

 private:
  /// Bit i: i differs from 0 in its low and in its high three bits.
  static constexpr std::uint64_t kBothTurn = 0xfefefefefefefe00U;

  static constexpr std::uint64_t kOneBit = 1;

  /// Whether a coordinate, or one of two that are or-ed, is outside the block.
  [[nodiscard]] static bool outside(std::int64_t v) noexcept {
    return (static_cast<std::uint64_t>(v) >> (kFraction + 3)) != 0;
  }
  [[nodiscard]] static unsigned index_of(std::int64_t b, std::int64_t c) noexcept {
    return static_cast<unsigned>(static_cast<std::uint64_t>(b) >> kFraction) |
           (static_cast<unsigned>(static_cast<std::uint64_t>(c) >> (kFraction - 3)) & 56U);
  }
  [[nodiscard]] static std::uint64_t bit(std::int32_t b_cell, std::int32_t c_cell) noexcept {
    return std::uint64_t{1} << static_cast<unsigned>((b_cell & 7) | ((c_cell & 7) << 3));
  }
  /// Words of the block that the cells lie in, which are relative to this block.
  [[nodiscard]] std::uint64_t* words_at(std::int32_t b_cell, std::int32_t c_cell) noexcept {
    const std::int32_t a = a_ >> 3;
    const std::int32_t b = b_block_ + (b_cell >> 3);
    const std::int32_t c = c_block_ + (c_cell >> 3);
    if (walk_.axis_ == 0) return words_of_(BlockCoord{a, b, c});
    return words_of_(walk_.axis_ == 1 ? BlockCoord{b, a, c} : BlockCoord{b, c, a});
  }
  /// How far the border is that a step from v goes towards.
  [[nodiscard]] static double to_border(std::int64_t v, std::int64_t step) noexcept {
    const std::int64_t inside = v & (kOne - 1);
    return static_cast<double>(step > 0 ? kOne - inside : inside);
  }

  void cross(std::int64_t b_to, std::int64_t c_to) noexcept {
    const std::int32_t b_from_cell = cell(b_);
    const std::int32_t c_from_cell = cell(c_);
    const std::int32_t b_to_cell = cell(b_to);
    const std::int32_t c_to_cell = cell(c_to);
    const bool leaves_block = ((b_to_cell | c_to_cell) & ~7) != 0;
    words_[a_ & 7] |= bit(b_from_cell, c_from_cell);
    if (b_from_cell != b_to_cell && c_from_cell != c_to_cell) {
      // Two borders in one slab: a voxel in between, after the border that comes first.
      const std::int64_t b_step = walk_.across_[0].step;
      const std::int64_t c_step = walk_.across_[1].step;
      const bool b_first = to_border(b_, b_step) * static_cast<double>(std::abs(c_step)) <=
                           to_border(c_, c_step) * static_cast<double>(std::abs(b_step));
      const std::int32_t b_mid = b_first ? b_to_cell : b_from_cell;
      const std::int32_t c_mid = b_first ? c_from_cell : c_to_cell;
      std::uint64_t* const mid = leaves_block ? words_at(b_mid, c_mid) : words_;
      const bool corner = kAllCorners && leaves_block;
      if (mid == nullptr || (corner && words_at(b_first ? b_from_cell : b_to_cell,
                                                b_first ? c_to_cell : c_from_cell) == nullptr)) {
        words_ = nullptr;
        return;
      }
      mid[a_ & 7] |= bit(b_mid, c_mid);
    }
    if (leaves_block) {
      words_ = words_at(b_to_cell, c_to_cell);
      if (words_ == nullptr) return;
      b_block_ += b_to_cell >> 3;
      c_block_ += c_to_cell >> 3;
      b_to &= kBlock - 1;
      c_to &= kBlock - 1;
    }
    words_[a_ & 7] |= bit(b_to_cell, c_to_cell);
    b_ = b_to;
    c_ = c_to;
  }

  const SlabWalk& walk_;
  WordsOf& words_of_;
  std::int32_t a_;
  std::int32_t b_block_;
  std::int32_t c_block_;
  std::int64_t b_;
  std::int64_t c_;
  std::uint64_t* words_;  ///< Null: stopped.
};

template <bool kAllCorners, class WordsOf>
bool SlabWalk::walk(WordsOf&& words_of) const noexcept {
  const Across& along_b = across_[0];
  const Across& along_c = across_[1];
  Place<kAllCorners, WordsOf> place(*this, words_of);
  if (slabs_ > 0 && !place.stopped()) {
    place.cross_to(along_b.first, along_c.first);
    if (!place.stopped()) place.enter_next();
    for (std::int32_t done = 1; done < slabs_ && !place.stopped();) {
      done += place.cross_plain_slabs(slabs_ - done);
      if (done == slabs_ || place.stopped()) break;
      place.cross_to(along_b.first + done * along_b.step, along_c.first + done * along_c.step);
      if (place.stopped()) break;
      place.enter_next();
      ++done;
    }
  }
  if (!place.stopped()) place.cross_to(along_b.end, along_c.end);
  return !place.stopped();
}

}  // namespace tessera
