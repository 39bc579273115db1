// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A ray through the grid, by slabs of voxels across the axis on which it is longest. In a slab it
// crosses at most one voxel border on each other axis, so it marks one to three voxels, all of them
// in one word of a bitmap whose words run along that axis. The eight slabs of a block are worked
// out at once; in them the ray crosses at most one border of blocks on each axis across.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "tessera/base/geometry.hpp"
#include "tessera/grid/lattice.hpp"
#include "tessera/inference/internal/block_slabs.hpp"

namespace tessera {

/// The two axes across axis, in ascending order.
[[nodiscard]] constexpr std::array<int, 2> axes_across(int axis) noexcept {
  return {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2};
}

/// Fixed-point coordinates: 2^-38 of a voxel, over the whole grid in 62 bits.
class SlabWalk {
 public:
  /// From a to b, or to the part of it (0 .. 1]; both in voxels and in the grid, which the walk
  /// does not leave. The voxels of a part are among those of the whole, to the bit.
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
  /// ends the walk, and false is returned. Sets every voxel's bit. Asks once for each
  /// block that the walk enters, in its order; with kAllCorners also for those that a part of this
  /// ray could enter in place of another where two borders meet.
  template <bool kAllCorners, class WordsOf>
  bool walk(WordsOf&& words_of) const noexcept {
    return walk_blocks<kAllCorners, true>(words_of);
  }
  /// Calls visit(block) for the blocks that walk<true> asks for, in its order; false from it ends
  /// the walk, and false is returned. Marks nothing. O(blocks).
  template <class Visit>
  bool for_blocks(Visit&& visit) const noexcept {
    return walk_blocks<true, false>(visit);
  }

 private:
  using Pair = SlabPoint;
  using Slabs = BlockSlabs;
  static constexpr int kFraction = Slabs::kFraction;
  static constexpr std::int64_t kOne = Slabs::kOne;
  static constexpr std::int64_t kBlock = kBlockEdge * kOne;
  /// Of the grid.
  static constexpr std::int64_t kLowest = -kVoxelLimit * kOne;
  static constexpr std::int64_t kHighest = kVoxelLimit * kOne - 1;

  [[nodiscard]] static std::int32_t cell(std::int64_t v) noexcept { return Slabs::cell(v); }
  /// Floor: which block of its axis v lies in.
  [[nodiscard]] static std::int32_t block(std::int64_t v) noexcept {
    return static_cast<std::int32_t>(v >> (kFraction + 3));
  }
  /// The walk's coordinate on one of the axes across.
  struct Across {
    std::int64_t start = 0;
    std::int64_t first = 0;  ///< Where the first slab ends.
    std::int64_t step = 0;   ///< A slab; at most one voxel.
    std::int64_t end = 0;
  };

  [[nodiscard]] BlockCoord block_at(std::int32_t a, std::int32_t b, std::int32_t c) const noexcept {
    if (axis_ == 0) return {a, b, c};
    return axis_ == 1 ? BlockCoord{b, a, c} : BlockCoord{b, c, a};
  }

  /// A block's slab that a walk through it comes into first.
  [[nodiscard]] int entry_slab() const noexcept { return direction_ > 0 ? 0 : 7; }
  /// The slabs of the blocks at a, which the walk enters at `from` and leaves at `to`.
  template <bool kAllCorners, bool kMarks, class WordsOf>
  bool walk_blocks(WordsOf& words_of) const noexcept;
  template <bool kAllCorners, bool kMarks, class WordsOf, class WorkOut, class Mark>
  bool cross(std::int32_t a, Pair from, Pair to, WordsOf& words_of, Slabs& slabs,
             WorkOut&& work_out, Mark&& mark) const noexcept;

  int axis_ = 0;
  std::int32_t direction_ = 1;
  std::int32_t from_ = 0;   ///< The first slab.
  std::int32_t slabs_ = 0;  ///< Slabs beyond it.
  std::array<Across, 2> across_{};
};

/// Words are asked for before the slabs are worked out: reading memory takes as long.
template <bool kAllCorners, bool kMarks, class WordsOf, class WorkOut, class Mark>
// NOLINTNEXTLINE(readability-function-cognitive-complexity): its branches at compile time count
bool SlabWalk::cross(std::int32_t a, Pair from, Pair to, WordsOf& words_of, Slabs& slabs,
                     WorkOut&& work_out, Mark&& mark) const noexcept {
  const std::int32_t b = block(from.b);
  const std::int32_t c = block(from.c);
  const std::int32_t b_on = block(to.b) - b;
  const std::int32_t c_on = block(to.c) - c;
  const Pair corner{(b - 1) * kBlock, (c - 1) * kBlock};
  const auto words = words_of(block_at(a, b, c));
  if (!words) return false;
  if constexpr (kMarks) {
    work_out(corner);
    mark(words, 0, 0);
  }
  if ((b_on | c_on) == 0) return true;
  const auto mark_beside = [&](std::int32_t b_beside, std::int32_t c_beside) {
    const auto beside = words_of(block_at(a, b + b_beside, c + c_beside));
    if constexpr (kMarks) {
      if (beside) mark(beside, b_beside, c_beside);
    }
    return static_cast<bool>(beside);
  };
  if (b_on != 0 && c_on != 0) {
    if constexpr (!kMarks) work_out(corner);  // only here the slabs tell which block comes first
    const Slabs::Exit exit = slabs.leaves_first(a == from_ >> 3 ? from_ & 7 : entry_slab());
    if (!mark_beside(exit.by_b ? b_on : 0, exit.by_b ? 0 : c_on)) return false;
    if (kAllCorners && exit.at_once && !mark_beside(exit.by_b ? 0 : b_on, exit.by_b ? c_on : 0))
      return false;
  }
  return mark_beside(b_on, c_on);
}

template <bool kAllCorners, bool kMarks, class WordsOf>
bool SlabWalk::walk_blocks(WordsOf& words_of) const noexcept {
  const Pair start{across_[0].start, across_[1].start};
  const Pair end{across_[0].end, across_[1].end};
  const Pair slab{across_[0].step, across_[1].step};
  const Pair to_lower = direction_ > 0 ? Pair{} : 8 * slab;
  const std::int32_t last_slab = from_ + direction_ * slabs_;
  const int entry = entry_slab();
  std::int32_t a = from_ >> 3;
  // Where the ray's line enters the block's eight slabs, the first of which it may begin in.
  Pair enters = Pair{across_[0].first, across_[1].first} -
                std::int64_t{(from_ & 7) - entry} * direction_ * slab - slab;
  Slabs slabs(slab, direction_);
  const auto cross_part = [&](Pair from, int first, Pair to, int last) {
    const auto work_out = [&](Pair corner) {
      slabs.cross_some(enters + to_lower - corner, first, from - corner, last, to - corner);
    };
    return cross<kAllCorners, kMarks>(a, from, to, words_of, slabs, work_out,
                                      [&](std::uint64_t* words, std::int32_t b, std::int32_t c) {
                                        slabs.mark(words, b, c, std::min(first, last),
                                                   std::max(first, last));
                                      });
  };
  const auto cross_all = [&](Pair from, Pair to) {
    const auto work_out = [&](Pair corner) { slabs.cross_all(from + to_lower - corner); };
    return cross<kAllCorners, kMarks>(a, from, to, words_of, slabs, work_out,
                                      [&](std::uint64_t* words, std::int32_t b, std::int32_t c) {
                                        slabs.mark(words, b, c, 0, 7);
                                      });
  };
  if (a == last_slab >> 3) return cross_part(start, from_ & 7, end, last_slab & 7);
  bool on = cross_part(start, from_ & 7, enters + 8 * slab, 7 - entry);
  for (a += direction_; on && a != last_slab >> 3; a += direction_) {
    enters = enters + 8 * slab;
    on = cross_all(enters, enters + 8 * slab);
  }
  enters = enters + 8 * slab;
  return on && cross_part(enters, entry, end, last_slab & 7);
}

}  // namespace tessera
