// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "octet_code.hpp"
#include "tessera/exchange/internal/block_codec.hpp"

namespace tessera {

namespace {

using detail::kCodedClasses;

struct Count {
  int component = 0;
  float count = 0.0F;
  [[nodiscard]] bool before(const Count& other) const noexcept {
    return count > other.count || (count == other.count && component < other.component);
  }
};

/// The largest counts of a voxel, falling, of equal ones the lower component first.
struct Largest {
  std::array<Count, kCodedClasses> counts{};
  float rest = 0.0F;  ///< What the others had.

  void add(Count count) noexcept {
    for (Count& place : counts) {
      if (count.before(place)) std::swap(count, place);
    }
    rest += count.count;
  }
};

/// Evidence that is so many levels under the largest count is less than 1/32 of it.
constexpr int kFaintLevels = 20;

int quantise_rest(BlockContent& content, int row, float rest, int largest) noexcept {
  int level = level_of(rest);
  if (level < largest - kFaintLevels) level = 0;
  if (level != 0) content.add_rest(row, 0.0F);
  content.set_rest(row, count_of_level(level));
  return level;
}

/// False iff the voxel has no label evidence.
bool quantise_labels(BlockContent& content, int row) noexcept {
  Largest largest;
  for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    const float count = content.count(component, row);
    if (!(count > 0.0F)) continue;
    largest.add({component, count});
    content.set(component, row, 0.0F);
  }
  float rest = content.rest(row) + largest.rest;
  const int most = level_of(largest.counts[0].count);
  const int least = most > kFaintLevels ? most - kFaintLevels : 1;
  Count last;
  int classes = 0;
  int last_level = kMostLevel + 1;
  for (const Count& count : largest.counts) {
    int level = level_of(count.count);
    // What has less evidence must not come before the other where levels are equal.
    if (level >= last_level) level = count.component < last.component ? last_level - 1 : last_level;
    if (level < least) {
      rest += count.count;
      continue;
    }
    content.set(count.component, row, count_of_level(level));
    classes += level != 0 ? 1 : 0;
    last = count;
    last_level = level;
  }
  const bool has_rest = quantise_rest(content, row, rest, most) != 0;
  if (has_rest && classes == kCodedClasses && content.centroid(row).known())
    content.set_centroid(row, {});
  return has_rest || most != 0;
}

void quantise_octet(BlockContent& content, int octet) noexcept {
  std::array<int, kOctetVoxels> free_rows{};
  std::size_t count = 0;
  unsigned sum = 0;
  for (int v = 0; v < kOctetVoxels; ++v) {
    const int row = row_order(octet, v);
    const bool labelled = quantise_labels(content, row);
    const unsigned passes = content.passes(row);
    if (passes == 0) continue;
    if (labelled) {
      content.set_passes(row, static_cast<std::uint16_t>(passes_of_level(passes_level_of(passes))));
      continue;
    }
    free_rows[count++] = row;
    sum += passes;
  }
  if (count == 0) return;
  const auto n = static_cast<unsigned>(count);
  const auto mean = static_cast<std::uint16_t>(passes_of_level(passes_level_of((sum + n / 2) / n)));
  for (std::size_t i = 0; i < count; ++i) content.set_passes(free_rows[i], mean);
}

}  // namespace

void quantise(BlockContent& content) noexcept {
  for (std::uint64_t octets = content.label_octets() | content.pass_octets(); octets != 0;
       octets &= octets - 1)
    quantise_octet(content, std::countr_zero(octets));
}

}  // namespace tessera
