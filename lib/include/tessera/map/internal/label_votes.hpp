// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What points said of the classes of a place, over all scans, in cells of 4 x 4 x 2 voxels. Labels
// are made from it, and it is not made from labels: so an error of one scan does not confirm
// itself. Of a layer of a block, in its label page.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tessera {

struct LabelVotes {
  static constexpr int kCellEdge = 4;         ///< Voxels in x and y; a cell is as high as a layer.
  static constexpr std::size_t kCells = 4;    ///< x + 2 y.
  static constexpr std::size_t kClasses = 5;  ///< That a layer has votes on at once.
  static constexpr float kPerPoint = 8.0F;    ///< Votes of a point of weight one.
  /// What one addition can be, and what a cell can have: more halves all that it has.
  static constexpr std::uint32_t kMostAdded = 1U << 12U;
  static constexpr std::uint32_t kMostOfCell = 1U << 13U;

  std::array<std::array<std::uint16_t, kCells>, kClasses> votes{};
  std::array<std::uint8_t, kClasses> labels{};
  bool begun = false;  ///< What the layer's labels said before the first vote is in it.
  std::uint16_t unused = 0;

  /// Rounded to the nearest; at most kMostAdded.
  [[nodiscard]] static constexpr std::uint32_t votes_of(float votes) noexcept {
    constexpr auto kMost = static_cast<float>(kMostAdded);
    const float up = (votes < kMost ? votes : kMost) + 0.5F;
    return static_cast<std::uint32_t>(up);
  }
  /// octet: of a block, x + 4 y + 16 z.
  [[nodiscard]] static constexpr std::size_t cell_of_octet(int octet) noexcept {
    const auto o = static_cast<std::size_t>(octet);
    return ((o & 3U) >> 1U) + 2 * ((o & 12U) >> 3U);
  }

  /// Adds votes to a cell. Where a layer has no room for one more class, its class with the fewest
  /// votes, among equals the higher, gives way: it loses as many, of this cell first, and the new
  /// class takes the place of one that has none left. O(kClasses kCells).
  void add(std::size_t cell, std::uint8_t label, std::uint32_t count) noexcept;
  /// Adds all that another has, whose cells have at most kMostOfCell each; the same whichever is
  /// added to which. The classes with most votes stay, among equals the lower, and a cell that has
  /// too many halves all of them. O(kClasses^2 + kClasses kCells).
  void add(const LabelVotes& other) noexcept;
  /// Slots that have votes by ascending classes; how many. O(kClasses^2).
  std::size_t by_class(std::array<std::uint8_t, kClasses>& slots) const noexcept;

 private:
  [[nodiscard]] bool has_votes(std::size_t slot) const noexcept {
    return std::bit_cast<std::uint64_t>(votes[slot]) != 0;
  }
  [[nodiscard]] std::uint32_t total(std::size_t slot) const noexcept {
    std::uint32_t sum = 0;
    for (const std::uint16_t count : votes[slot]) sum += count;
    return sum;
  }
  void take(std::size_t slot, std::size_t first_cell, std::uint32_t count) noexcept;
};
static_assert(sizeof(LabelVotes) == 48);

}  // namespace tessera
