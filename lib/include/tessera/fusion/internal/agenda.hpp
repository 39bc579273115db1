// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which blocks of the global map are behind, in the order in which they are due: lists threaded
// through the blocks' records, so that nothing has to be sized or sorted. Putting a block on a list
// and taking it off are O(1).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "tessera/base/assert.hpp"
#include "tessera/grid/lattice.hpp"

namespace tessera {

/// Where a record is on the agenda. Numbers of records plus one; 0: none.
struct AgendaLink {
  std::uint32_t next = 0;
  std::uint32_t previous = 0;
  std::uint8_t list = 0;  ///< Plus one; 0: on none.
};

class Agenda {
 public:
  /// By powers of two of the distance to where attention is, in blocks.
  static constexpr std::size_t kRings = 8;
  /// What is to be done: sums of contributions, then what depends on sums.
  enum Work : std::uint8_t { kSums = 0, kOutput = 1, kWorks = 2 };

  [[nodiscard]] static std::size_t ring_of(BlockCoord block, BlockCoord focus) noexcept {
    const auto apart = [](std::int32_t a, std::int32_t b) {
      return static_cast<std::uint32_t>(a < b ? b - a : a - b);
    };
    const std::uint32_t distance =
        apart(block.x, focus.x) | apart(block.y, focus.y) | apart(block.z, focus.z);
    const auto ring = static_cast<std::size_t>(std::bit_width(distance));
    return ring < kRings ? ring : kRings - 1;
  }

  /// records: link(number) gives a record's AgendaLink. Puts it at the end of a list that it is not
  /// on; it must be on none.
  template <class Records>
  void append(Records& records, std::uint32_t number, Work work, std::size_t ring) noexcept {
    AgendaLink& link = records.link(number);
    TESSERA_ASSERT(link.list == 0);
    const std::size_t at = ring * kWorks + work;
    link = {0, last_[at], static_cast<std::uint8_t>(at + 1)};
    (last_[at] != 0 ? records.link(last_[at]).next : first_[at]) = number;
    last_[at] = number;
    ++waiting_[work];
  }
  /// Takes a record off the list that it is on; does nothing if it is on none.
  template <class Records>
  void remove(Records& records, std::uint32_t number) noexcept {
    AgendaLink& link = records.link(number);
    if (link.list == 0) return;
    const std::size_t at = std::size_t{link.list} - 1;
    (link.previous != 0 ? records.link(link.previous).next : first_[at]) = link.next;
    (link.next != 0 ? records.link(link.next).previous : last_[at]) = link.previous;
    link = {};
    --waiting_[at % kWorks];
  }
  /// What is due first: of the nearest ring, sums before what depends on them. 0: nothing.
  [[nodiscard]] std::uint32_t first() const noexcept {
    for (const std::uint32_t number : first_) {
      if (number != 0) return number;
    }
    return 0;
  }
  [[nodiscard]] static Work work_of(const AgendaLink& link) noexcept {
    return static_cast<Work>((link.list - 1) % kWorks);
  }
  [[nodiscard]] std::uint32_t waiting() const noexcept {
    return waiting_[kSums] + waiting_[kOutput];
  }

 private:
  std::array<std::uint32_t, kRings * kWorks> first_{};
  std::array<std::uint32_t, kRings * kWorks> last_{};
  std::array<std::uint32_t, kWorks> waiting_{};
};

}  // namespace tessera
