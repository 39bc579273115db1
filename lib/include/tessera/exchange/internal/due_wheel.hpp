// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What waits, by the time at which it is due: lists threaded through the records themselves, one
// for each of a number of short intervals. Putting a record in and taking one out are O(1).
#pragma once

#include <array>
#include <cstdint>

#include "tessera/base/assert.hpp"

namespace tessera {

/// Where a record is in a wheel. Numbers of records plus one; 0: none.
struct DueLink {
  std::uint32_t next = 0;
  std::uint32_t previous = 0;
  std::uint8_t slot = 0;  ///< Plus one; 0: in none.
};

class DueWheel {
 public:
  /// Intervals that are told apart. What is due later than the last of them is put there.
  static constexpr std::int64_t kSlots = 64;

  /// width_us: of an interval, above 0.
  explicit DueWheel(std::int64_t width_us) noexcept : width_us_(width_us) {}

  /// records: link(number) gives a record's DueLink, which must be in no wheel. O(1).
  template <class Records>
  void insert(Records& records, std::uint32_t number, std::int64_t due_us) noexcept {
    DueLink& link = records.link(number);
    TESSERA_ASSERT(link.slot == 0);
    std::int64_t interval = due_us / width_us_;
    if (interval < first_) interval = first_;
    if (interval >= first_ + kSlots) interval = first_ + kSlots - 1;
    const auto at = static_cast<std::size_t>(interval % kSlots);
    Slot& slot = slots_[at];
    link = {0, slot.last, static_cast<std::uint8_t>(at + 1)};
    (slot.last != 0 ? records.link(slot.last).next : slot.first) = number;
    slot.last = number;
    ++slot.count;
    ++waiting_;
  }
  /// Takes a record out; does nothing if it is in no wheel. O(1).
  template <class Records>
  void remove(Records& records, std::uint32_t number) noexcept {
    DueLink& link = records.link(number);
    if (link.slot == 0) return;
    Slot& slot = slots_[std::size_t{link.slot} - 1];
    (link.previous != 0 ? records.link(link.previous).next : slot.first) = link.next;
    (link.next != 0 ? records.link(link.next).previous : slot.last) = link.previous;
    link = {};
    --slot.count;
    --waiting_;
  }

  /// Goes on to now_us, from where on intervals are counted, but never past a record. O(kSlots).
  void advance(std::int64_t now_us) noexcept {
    const std::int64_t now = now_us / width_us_;
    if (waiting_ == 0 && first_ < now) first_ = now;
    while (first_ < now && slots_[static_cast<std::size_t>(first_ % kSlots)].count == 0) ++first_;
  }
  /// The record that is due first, among equals the one that came first; 0: none. O(kSlots).
  [[nodiscard]] std::uint32_t first() const noexcept {
    for (std::int64_t i = 0; waiting_ != 0 && i < kSlots; ++i) {
      const Slot& slot = slots_[static_cast<std::size_t>((first_ + i) % kSlots)];
      if (slot.first != 0) return slot.first;
    }
    return 0;
  }
  /// How many must be done now, at each of the ticks to come as many, so that none is late and
  /// the work is even. tick_us: between two ticks, above 0. O(kSlots).
  [[nodiscard]] std::uint32_t pace(std::int64_t now_us, std::int64_t tick_us) const noexcept {
    std::int64_t sum = 0;
    std::int64_t most = 0;
    for (std::int64_t i = 0; i < kSlots && sum < waiting_; ++i) {
      sum += slots_[static_cast<std::size_t>((first_ + i) % kSlots)].count;
      const std::int64_t left_us = (first_ + i) * width_us_ - now_us;
      const std::int64_t ticks = left_us > 0 ? left_us / tick_us + 1 : 1;
      const std::int64_t each = (sum + ticks - 1) / ticks;
      most = each > most ? each : most;
    }
    return static_cast<std::uint32_t>(most);
  }
  /// Those whose interval has begun before now_us. O(kSlots).
  [[nodiscard]] std::uint32_t overdue(std::int64_t now_us) const noexcept {
    std::uint32_t sum = 0;
    for (std::int64_t i = 0; i < kSlots && (first_ + i) * width_us_ < now_us; ++i)
      sum += slots_[static_cast<std::size_t>((first_ + i) % kSlots)].count;
    return sum;
  }
  [[nodiscard]] std::uint32_t waiting() const noexcept { return waiting_; }

 private:
  struct Slot {
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    std::uint32_t count = 0;
  };
  std::array<Slot, kSlots> slots_{};
  std::int64_t width_us_;
  std::int64_t first_ = 0;  ///< The interval that the first slot stands for.
  std::uint32_t waiting_ = 0;
};

}  // namespace tessera
