// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/internal/label_votes.hpp"

#include <span>

namespace tessera {

void LabelVotes::add(std::size_t cell, std::uint8_t label, std::uint32_t count) noexcept {
  count = count < kMostAdded ? count : kMostAdded;
  if (count == 0) return;
  std::size_t slot = kClasses;
  std::size_t fewest = 0;
  std::uint32_t fewest_votes = ~std::uint32_t{0};
  for (std::size_t s = 0; s < kClasses; ++s) {
    const std::uint32_t its = total(s);
    if (its != 0 && labels[s] == label) {
      slot = s;
      break;
    }
    if (its < fewest_votes || (its == fewest_votes && labels[s] > labels[fewest])) {
      fewest = s;
      fewest_votes = its;
    }
  }
  if (slot == kClasses) {
    if (fewest_votes >= count) return take(fewest, cell, count);
    count -= fewest_votes;
    slot = fewest;
    votes[slot] = {};
    labels[slot] = label;
  }
  std::uint32_t in_cell = count;
  for (const std::array<std::uint16_t, kCells>& of_class : votes) in_cell += of_class[cell];
  if (in_cell > kMostOfCell) {
    for (std::array<std::uint16_t, kCells>& of_class : votes) of_class[cell] /= 2;
  }
  votes[slot][cell] = static_cast<std::uint16_t>(votes[slot][cell] + count);
}

std::size_t LabelVotes::by_class(std::array<std::uint8_t, kClasses>& slots) const noexcept {
  std::size_t found = 0;
  for (std::size_t s = 0; s < kClasses; ++s) {
    if (total(s) == 0) continue;
    std::size_t at = found++;
    for (; at > 0 && labels[slots[at - 1]] > labels[s]; --at) slots[at] = slots[at - 1];
    slots[at] = static_cast<std::uint8_t>(s);
  }
  return found;
}

void LabelVotes::add(const LabelVotes& other) noexcept {
  std::array<std::uint8_t, kClasses> slots{};
  const std::size_t found = other.by_class(slots);
  for (const std::uint8_t slot : std::span(slots).first(found)) {
    for (std::size_t cell = 0; cell < kCells; ++cell) {
      // One addition is at most half of what a cell can have.
      const std::uint32_t count = other.votes[slot][cell];
      add(cell, other.labels[slot], count);
      if (count > kMostAdded) add(cell, other.labels[slot], count - kMostAdded);
    }
  }
}

void LabelVotes::take(std::size_t slot, std::size_t first_cell, std::uint32_t count) noexcept {
  for (std::size_t i = 0; i < kCells; ++i) {
    std::uint16_t& its = votes[slot][(first_cell + i) % kCells];
    const std::uint32_t taken = its < count ? its : count;
    its = static_cast<std::uint16_t>(its - taken);
    count -= taken;
  }
}

}  // namespace tessera
