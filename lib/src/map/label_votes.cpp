// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/internal/label_votes.hpp"

#include <algorithm>
#include <span>

namespace tessera {

void LabelVotes::add(std::size_t cell, std::uint8_t label, std::uint32_t count) noexcept {
  count = count < kMostAdded ? count : kMostAdded;
  if (count == 0) return;
  std::size_t slot = 0;
  while (slot < kClasses && !(labels[slot] == label && has_votes(slot))) ++slot;
  if (slot == kClasses) {
    std::size_t fewest = 0;
    std::uint32_t fewest_votes = ~std::uint32_t{0};
    for (std::size_t s = 0; s < kClasses; ++s) {
      const std::uint32_t its = total(s);
      if (its < fewest_votes || (its == fewest_votes && labels[s] > labels[fewest])) {
        fewest = s;
        fewest_votes = its;
      }
    }
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

namespace {

/// Of one class, of two layers.
struct OfClass {
  std::array<std::uint32_t, LabelVotes::kCells> votes{};
  std::uint32_t total = 0;
  std::uint8_t label = 0;
};

/// Adds the classes of a layer to those before count. Returns how many they are then.
std::size_t join(const LabelVotes& from, std::span<OfClass> all, std::size_t count) noexcept {
  for (std::size_t s = 0; s < LabelVotes::kClasses; ++s) {
    std::uint32_t total = 0;
    for (const std::uint16_t votes : from.votes[s]) total += votes;
    if (total == 0) continue;
    std::size_t at = 0;
    while (at < count && all[at].label != from.labels[s]) ++at;
    count += at == count ? 1U : 0U;
    all[at].label = from.labels[s];
    all[at].total += total;
    for (std::size_t cell = 0; cell < LabelVotes::kCells; ++cell)
      all[at].votes[cell] += from.votes[s][cell];
  }
  return count;
}

}  // namespace

void LabelVotes::add(const LabelVotes& other) noexcept {
  std::array<OfClass, 2 * kClasses> all{};
  const auto sums = std::span(all).first(join(other, all, join(*this, all, 0)));
  const auto kept = sums.first(std::min(sums.size(), kClasses));
  const auto is_before = [](const OfClass& a, const OfClass& b) {
    return a.total != b.total ? a.total > b.total : a.label < b.label;
  };
  for (auto at = sums.begin(); at != sums.begin() + static_cast<std::ptrdiff_t>(kept.size()); ++at)
    std::iter_swap(at, std::min_element(at, sums.end(), is_before));
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    std::uint32_t in_cell = 0;
    for (const OfClass& of : kept) in_cell += of.votes[cell];
    for (OfClass& of : kept) of.votes[cell] /= in_cell > kMostOfCell ? 2U : 1U;
  }
  votes = {};
  labels = {};
  for (std::size_t s = 0; s < kept.size(); ++s) {
    labels[s] = kept[s].label;
    for (std::size_t cell = 0; cell < kCells; ++cell)
      votes[s][cell] = static_cast<std::uint16_t>(kept[s].votes[cell]);
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
