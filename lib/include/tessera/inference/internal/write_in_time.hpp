// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The order of writing: as it comes, or with a deadline from the sensor outwards.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

#include "tessera/grid/lattice.hpp"
#include "tessera/inference/internal/scan_work.hpp"

namespace tessera {

/// Rings double in width: 0 for the centre, r for 2^(r - 1) .. 2^r - 1 steps from it on the longest
/// axis. At most 22.
inline unsigned ring_of(const BlockCoord& at, const BlockCoord& centre) noexcept {
  const auto apart = [](std::int32_t a, std::int32_t b) {
    return static_cast<unsigned>(a < b ? b - a : a - b);
  };
  return static_cast<unsigned>(
      std::bit_width(apart(at.x, centre.x) | apart(at.y, centre.y) | apart(at.z, centre.z)));
}

/// Calls visit(item) for all items, by rings around the coordinates centre. O(items) a ring.
template <class Item, class Visit>
void visit_by_rings(std::span<Item> items, const BlockCoord& centre, Visit&& visit) noexcept {
  std::uint32_t rings = 0;
  for (const Item& item : items) rings |= std::uint32_t{1} << ring_of(item.coord, centre);
  for (; rings != 0; rings &= rings - 1) {
    const auto ring = static_cast<unsigned>(std::countr_zero(rings));
    for (Item& item : items) {
      if (ring_of(item.coord, centre) == ring) visit(item);
    }
  }
}

/// Calls write(item), or leave(item) for those that the deadline leaves out: in the order of items,
/// or with a deadline by rings around the coordinates centre, the clock read every batch items.
template <class Item, class Write, class Leave>
void write_in_time(std::span<const Item> items, const BlockCoord& centre, std::size_t batch,
                   ScanWork& work, Write&& write, Leave&& leave) noexcept {
  if (!work.has_deadline()) {
    for (const Item& item : items) write(item);
    return;
  }
  std::size_t visited = 0;
  visit_by_rings(items, centre, [&](const Item& item) {
    if (visited++ % batch == 0) static_cast<void>(work.in_time());
    if (work.cut()) {
      leave(item);
    } else {
      write(item);
    }
  });
}

}  // namespace tessera
