// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A ray through the grid, by slabs of voxels across the axis on which it is longest. In a slab it
// crosses at most one voxel border on each other axis, so it marks one to three voxels, all of them
// in one word of a bitmap whose words run along that axis. The eight slabs of a block are worked
// out at once; in them the ray crosses at most one border of blocks on each axis across.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "tessera/base/geometry.hpp"
#include "tessera/base/lanes.hpp"
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
  /// ends the walk, and false is returned. Sets every voxel's bit. Asks once for each
  /// block that the walk enters, in its order; with kAllCorners also for those that a part of this
  /// ray could enter in place of another where two borders meet.
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
  /// Coordinates on both.
  struct Pair {
    std::int64_t b = 0;
    std::int64_t c = 0;
    friend Pair operator+(Pair p, Pair q) noexcept { return {p.b + q.b, p.c + q.c}; }
    friend Pair operator-(Pair p, Pair q) noexcept { return {p.b - q.b, p.c - q.c}; }
    friend Pair operator*(std::int64_t n, Pair p) noexcept { return {n * p.b, n * p.c}; }
  };
  class Slabs;

  [[nodiscard]] BlockCoord block_at(std::int32_t a, std::int32_t b, std::int32_t c) const noexcept {
    if (axis_ == 0) return {a, b, c};
    return axis_ == 1 ? BlockCoord{b, a, c} : BlockCoord{b, c, a};
  }

  int axis_ = 0;
  std::int32_t direction_ = 1;
  std::int32_t from_ = 0;   ///< The first slab.
  std::int32_t slabs_ = 0;  ///< Slabs beyond it.
  std::array<Across, 2> across_{};
};

/// What a walk crosses in the eight slabs of a block, or in those of them that it goes through.
/// Coordinates are from a corner one block before the block in which it enters the slabs, as it may
/// get to the blocks before and behind that one; a place is b + 32 c in whole voxels from there.
class SlabWalk::Slabs {
 public:
  explicit Slabs(const SlabWalk& walk) noexcept
      : up_(walk.direction_ * Pair{walk.across_[0].step, walk.across_[1].step}),
        size_b_(static_cast<double>(std::abs(up_.b))),
        size_c_(static_cast<double>(std::abs(up_.c))),
        b_grows_(walk.across_[0].step > 0),
        c_grows_(walk.across_[1].step > 0),
        entry_(walk.direction_ > 0 ? 0 : 1),
        direction_(walk.direction_) {
    for (std::size_t i = 0; i < ramp_b_.size(); ++i) {
      const auto n = static_cast<std::int64_t>(2 * i);
      ramp_b_[i] = Long2{n * up_.b, (n + 1) * up_.b};
      ramp_c_[i] = Long2{n * up_.c, (n + 1) * up_.c};
    }
  }

  /// All eight. lower: where the ray meets the border below slab 0.
  void cross_all(Pair lower) noexcept {
    const Int4 low = four_places(lower, 0);
    const Int4 high = four_places(lower, 2);
    const std::int32_t last = place(lower + 8 * up_);
    std::memcpy(&places_[0], &low, sizeof(low));
    std::memcpy(&places_[4], &high, sizeof(high));
    places_[8] = last;
    unsigned turns = both_turn(low, next_lanes(low, high)) |
                     (both_turn(high, next_lanes(high, Int4{last, last, last, last})) << 4U);
    corners_ = 0;
    for (; turns != 0; turns &= turns - 1) {
      const int slab = std::countr_zero(turns);
      add_corner(slab, lower + (slab + entry_) * up_);
    }
  }
  /// From slab `first` on, where the walk begins at `from`, to slab `last`, where it ends at `to`.
  void cross_some(Pair lower, int first, Pair from, int last, Pair to) noexcept {
    corners_ = 0;
    for (int slab = first; slab != last + direction_; slab += direction_) {
      const Pair in = slab == first ? from : lower + (slab + entry_) * up_;
      const Pair out = slab == last ? to : lower + (slab + 1 - entry_) * up_;
      place_in(slab) = place(in);
      place_out(slab) = place(out);
      const auto turned = static_cast<unsigned>(place(in) ^ place(out));
      if ((turned & 31U) != 0 && (turned >> 5U) != 0) add_corner(slab, in);
    }
  }

  /// Marks what is crossed in the slabs lowest .. highest and in the block that is b, c blocks from
  /// the one where the walk enters them.
  void mark(std::uint64_t* words, std::int32_t b, std::int32_t c, int lowest,
            int highest) const noexcept {
    const std::uint64_t* const bits = kBits.data() - (8 * b + 8 * 32 * c);
    std::uint64_t here = bits[places_[static_cast<std::size_t>(lowest)]];
    for (int slab = lowest; slab <= highest; ++slab) {
      const std::uint64_t there = bits[places_[static_cast<std::size_t>(slab) + 1]];
      words[slab] |= here | there;
      here = there;
    }
    for (std::size_t i = 0; i < corners_; ++i) words[corner_slab_[i]] |= bits[corner_place_[i]];
  }

  /// How a walk leaves the block that it is in when it comes into slab `first`, if it leaves it on
  /// both axes: on which of them it does so first, and whether in the same slab.
  struct Exit {
    bool by_b = false;
    bool at_once = false;
  };
  [[nodiscard]] Exit leaves_first(int first) noexcept {
    int slab = first;
    while (in_block(place_out(slab)) && in_block(place_out(slab) >> 5)) slab += direction_;
    const bool on_b = !in_block(place_out(slab));
    const bool on_c = !in_block(place_out(slab) >> 5);
    if (!(on_b && on_c)) return {on_b, false};
    std::size_t corner = 0;
    while (corner_slab_[corner] != slab) ++corner;
    return {!in_block(corner_place_[corner]), true};
  }

 private:
  /// A place's bit in a block's word: 0 outside the block.
  static constexpr std::array<std::uint64_t, 24 * 32> kBits = [] {
    std::array<std::uint64_t, 24 * 32> bits{};
    for (unsigned i = 0; i < 64; ++i) bits[(8 + i / 8) * 32 + 8 + i % 8] = std::uint64_t{1} << i;
    return bits;
  }();

  [[nodiscard]] static std::int32_t place(Pair at) noexcept { return cell(at.b) | cell(at.c) << 5; }
  [[nodiscard]] static bool in_block(std::int32_t place) noexcept { return (place & 24) == 8; }
  [[nodiscard]] std::int32_t& place_in(int slab) noexcept {
    return places_[static_cast<std::size_t>(slab + entry_)];
  }
  [[nodiscard]] std::int32_t& place_out(int slab) noexcept {
    return places_[static_cast<std::size_t>(slab + 1 - entry_)];
  }
  /// The places on four borders, from border 2 i on.
  [[nodiscard]] Int4 four_places(Pair lower, std::size_t i) const noexcept {
    const Long2 b{lower.b, lower.b};
    const Long2 c{lower.c, lower.c};
    const Int4 b_upper = upper_halves(b + ramp_b_[i], b + ramp_b_[i + 1]);
    const Int4 c_upper = upper_halves(c + ramp_c_[i], c + ramp_c_[i + 1]);
    return (b_upper >> (kFraction - 32)) | ((c_upper >> (kFraction - 37)) & ~31);
  }
  /// Bit i: places i differ in b and in c.
  [[nodiscard]] static unsigned both_turn(Int4 here, Int4 there) noexcept {
    const Int4 turned = here ^ there;
    return bits_of(((turned & 31) == 0) | ((turned & ~31) == 0)) ^ 15U;
  }
  /// How far the border is that the walk goes towards.
  [[nodiscard]] static double to_border(std::int64_t v, bool grows) noexcept {
    const std::int64_t inside = v & (kOne - 1);
    return static_cast<double>(grows ? kOne - inside : inside);
  }
  /// Two borders in one slab: a voxel in between, after the border that comes first.
  void add_corner(int slab, Pair in) noexcept {
    const bool b_first = to_border(in.b, b_grows_) * size_c_ <= to_border(in.c, c_grows_) * size_b_;
    const std::int32_t b_from = b_first ? place_out(slab) : place_in(slab);
    const std::int32_t c_from = b_first ? place_in(slab) : place_out(slab);
    corner_slab_[corners_] = slab;
    corner_place_[corners_] = (b_from & 31) | (c_from & ~31);
    ++corners_;
  }

  Pair up_;  ///< From a border to the next higher one.
  double size_b_;
  double size_c_;
  bool b_grows_;
  bool c_grows_;
  int entry_;  ///< A slab's border where the walk comes in: 0 the lower, 1 the upper.
  std::int32_t direction_;
  std::size_t corners_ = 0;
  std::array<Long2, 4> ramp_b_{};
  std::array<Long2, 4> ramp_c_{};
  std::array<std::int32_t, 9> places_{};  ///< Where the ray meets the slabs' borders.
  std::array<std::int32_t, 8> corner_place_{};
  std::array<std::int32_t, 8> corner_slab_{};
};

template <bool kAllCorners, class WordsOf>
bool SlabWalk::walk(WordsOf&& words_of) const noexcept {
  const Pair step{across_[0].step, across_[1].step};
  const std::int32_t last_slab = from_ + direction_ * slabs_;
  const std::int32_t last_block = last_slab >> 3;
  const std::int32_t before = direction_ > 0 ? from_ & 7 : 7 - (from_ & 7);
  const Pair to_lower = direction_ > 0 ? Pair{} : 8 * step;
  const int entry = direction_ > 0 ? 0 : 7;
  Slabs slabs(*this);
  // Words are asked for before the slabs are worked out: reading memory takes as long.
  std::int32_t a = from_ >> 3;
  const auto cross = [&](Pair from, Pair to, auto&& work_out, auto&& mark) {
    const std::int32_t b = block(from.b);
    const std::int32_t c = block(from.c);
    const std::int32_t b_on = block(to.b) - b;
    const std::int32_t c_on = block(to.c) - c;
    std::uint64_t* const words = words_of(block_at(a, b, c));
    if (words == nullptr) return false;
    work_out(Pair{(b - 1) * kBlock, (c - 1) * kBlock});
    mark(words, 0, 0);
    if ((b_on | c_on) == 0) return true;
    const auto mark_beside = [&](std::int32_t b_beside, std::int32_t c_beside) {
      std::uint64_t* const beside = words_of(block_at(a, b + b_beside, c + c_beside));
      if (beside != nullptr) mark(beside, b_beside, c_beside);
      return beside != nullptr;
    };
    if (b_on != 0 && c_on != 0) {
      const Slabs::Exit exit = slabs.leaves_first(a == from_ >> 3 ? from_ & 7 : entry);
      if (!(exit.by_b ? mark_beside(b_on, 0) : mark_beside(0, c_on))) return false;
      if (kAllCorners && exit.at_once && !(exit.by_b ? mark_beside(0, c_on) : mark_beside(b_on, 0)))
        return false;
    }
    return mark_beside(b_on, c_on);
  };
  // Where the ray's line enters the block's eight slabs, the first of which it may begin in.
  Pair enters = Pair{across_[0].first, across_[1].first} - (before + 1) * step;
  const auto cross_part = [&](Pair from, int first, Pair to, int last) {
    return cross(
        from, to,
        [&](Pair corner) {
          slabs.cross_some(enters + to_lower - corner, first, from - corner, last, to - corner);
        },
        [&](std::uint64_t* words, std::int32_t b, std::int32_t c) {
          slabs.mark(words, b, c, std::min(first, last), std::max(first, last));
        });
  };
  const Pair start{across_[0].start, across_[1].start};
  const Pair end{across_[0].end, across_[1].end};
  if (a == last_block) return cross_part(start, from_ & 7, end, last_slab & 7);
  if (!cross_part(start, from_ & 7, enters + 8 * step, 7 - entry)) return false;
  for (;;) {
    a += direction_;
    enters = enters + 8 * step;
    if (a == last_block) return cross_part(enters, entry, end, last_slab & 7);
    const bool all = cross(
        enters, enters + 8 * step,
        [&](Pair corner) { slabs.cross_all(enters + to_lower - corner); },
        [&](std::uint64_t* words, std::int32_t b, std::int32_t c) {
          slabs.mark(words, b, c, 0, 7);
        });
    if (!all) return false;
  }
}

}  // namespace tessera
