// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What SlabWalk does in one block.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "tessera/base/internal/lanes.hpp"

namespace tessera {

/// Coordinates on the axes across a walk, in BlockSlabs::kOne of a voxel.
struct SlabPoint {
  std::int64_t b = 0;
  std::int64_t c = 0;
  friend SlabPoint operator+(SlabPoint p, SlabPoint q) noexcept { return {p.b + q.b, p.c + q.c}; }
  friend SlabPoint operator-(SlabPoint p, SlabPoint q) noexcept { return {p.b - q.b, p.c - q.c}; }
  friend SlabPoint operator*(std::int64_t n, SlabPoint p) noexcept { return {n * p.b, n * p.c}; }
};

/// What a walk crosses in the eight slabs of a block, or in those of them that it goes through.
/// Coordinates are from a corner one block before the block in which it enters the slabs, as it may
/// get to the blocks before and behind that one; a place is b + 32 c in whole voxels from there.
class BlockSlabs {
 public:
  static constexpr int kFraction = 38;
  static constexpr std::int64_t kOne = std::int64_t{1} << kFraction;

  /// Floor: which voxel of its axis v lies in.
  [[nodiscard]] static std::int32_t cell(std::int64_t v) noexcept {
    return static_cast<std::int32_t>(v >> kFraction);
  }

  /// Of a walk with that step from slab to slab, at most one voxel on each axis, in that direction
  /// (1 or -1) along its own.
  BlockSlabs(SlabPoint step, std::int32_t direction) noexcept
      : up_(direction * step),
        size_b_(static_cast<double>(std::abs(step.b))),
        size_c_(static_cast<double>(std::abs(step.c))),
        b_grows_(step.b > 0),
        c_grows_(step.c > 0),
        entry_(direction > 0 ? 0 : 1),
        direction_(direction) {
    for (std::size_t i = 0; i < ramp_b_.size(); ++i) {
      const auto n = static_cast<std::int64_t>(2 * i);
      ramp_b_[i] = Long2{n * up_.b, (n + 1) * up_.b};
      ramp_c_[i] = Long2{n * up_.c, (n + 1) * up_.c};
    }
  }

  /// All eight. lower: where the ray meets the border below slab 0.
  void cross_all(SlabPoint lower) noexcept {
    const Int4 low = four_places(lower, 0);
    const Int4 high = four_places(lower, 2);
    const std::int32_t last = place(lower + 8 * up_);
    std::memcpy(places_.data(), &low, sizeof(low));
    std::memcpy(places_.data() + 4, &high, sizeof(high));
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
  void cross_some(SlabPoint lower, int first, SlabPoint from, int last, SlabPoint to) noexcept {
    corners_ = 0;
    for (int slab = first; slab != last + direction_; slab += direction_) {
      const SlabPoint in = slab == first ? from : lower + (slab + entry_) * up_;
      const SlabPoint out = slab == last ? to : lower + (slab + 1 - entry_) * up_;
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
    const std::int32_t corner = 8 * b + 8 * 32 * c;
    const auto bit_of = [corner](std::int32_t place) {
      return kBits[static_cast<std::size_t>(place - corner)];
    };
    std::uint64_t here = bit_of(places_[static_cast<std::size_t>(lowest)]);
    for (int slab = lowest; slab <= highest; ++slab) {
      const std::uint64_t there = bit_of(places_[static_cast<std::size_t>(slab) + 1]);
      words[slab] |= here | there;
      here = there;
    }
    for (std::size_t i = 0; i < corners_; ++i) words[corner_slab_[i]] |= bit_of(corner_place_[i]);
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
  static constexpr std::array<std::uint64_t, 768> kBits = [] {
    std::array<std::uint64_t, 768> bits{};
    for (unsigned i = 0; i < 64; ++i) bits[(8 + i / 8) * 32 + 8 + i % 8] = std::uint64_t{1} << i;
    return bits;
  }();

  [[nodiscard]] static std::int32_t place(SlabPoint at) noexcept {
    return cell(at.b) | cell(at.c) << 5;
  }
  [[nodiscard]] static bool in_block(std::int32_t place) noexcept { return (place & 24) == 8; }
  [[nodiscard]] std::int32_t& place_in(int slab) noexcept {
    return places_[static_cast<std::size_t>(slab + entry_)];
  }
  [[nodiscard]] std::int32_t& place_out(int slab) noexcept {
    return places_[static_cast<std::size_t>(slab + 1 - entry_)];
  }
  /// The places on four borders, from border 2 i on.
  [[nodiscard]] Int4 four_places(SlabPoint lower, std::size_t i) const noexcept {
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
  void add_corner(int slab, SlabPoint in) noexcept {
    const bool b_first = to_border(in.b, b_grows_) * size_c_ <= to_border(in.c, c_grows_) * size_b_;
    const std::int32_t b_from = b_first ? place_out(slab) : place_in(slab);
    const std::int32_t c_from = b_first ? place_in(slab) : place_out(slab);
    corner_slab_[corners_] = slab;
    corner_place_[corners_] = (b_from & 31) | (c_from & ~31);
    ++corners_;
  }

  SlabPoint up_;  ///< From a border to the next higher one.
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

}  // namespace tessera
