// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/coverage.hpp"

#include <algorithm>

namespace tessera {

std::span<const VersionRange> Coverage::ranges_from(std::uint32_t version) const noexcept {
  const std::span<const VersionRange> all = ranges();
  const auto first = std::lower_bound(
      all.begin(), all.end(), version,
      [](const VersionRange& known, std::uint32_t sought) { return known.last < sought; });
  return {first, all.end()};
}

bool Coverage::contains(VersionRange range) const noexcept {
  if (range.first > range.last) return true;
  const std::span<const VersionRange> from = ranges_from(range.first);
  return !from.empty() && from.front().first <= range.first && range.last <= from.front().last;
}

std::uint32_t Coverage::lacking(VersionRange range) const noexcept {
  if (range.first > range.last) return 0;
  std::uint32_t lacking = range.last - range.first + 1;
  for (const VersionRange& known : ranges_from(range.first)) {
    if (known.first > range.last) break;
    lacking -= std::min(known.last, range.last) - std::max(known.first, range.first) + 1;
  }
  return lacking;
}

/// With room for one more range than there are, if the pool has it.
std::span<VersionRange> Coverage::taken_places() noexcept {
  if (part_ == 0 && count_ == kFewRanges && pool_ != nullptr) {
    part_ = pool_->take();
    if (part_ != 0) std::copy_n(few_.begin(), count_, pool_->at(part_).begin());
  }
  return places();
}

/// Does without a part of the pool if half of its own places are enough.
void Coverage::give_back() noexcept {
  if (part_ == 0 || count_ > kFewRanges / 2) return;
  std::copy_n(pool_->at(part_).begin(), count_, few_.begin());
  pool_->give(part_);
  part_ = 0;
}

bool Coverage::add(VersionRange range) noexcept {
  TESSERA_ASSERT(range.first >= 1);
  if (contains(range)) return false;
  const std::span<VersionRange> at = taken_places();
  // Those that it meets or touches become one with it. One before the first: no overflow at the
  // end.
  const auto touches = [](const VersionRange& before, const VersionRange& after) {
    return after.first - 1 <= before.last;
  };
  std::size_t from = 0;
  while (from < count_ && !touches(at[from], range)) ++from;
  std::size_t to = from;
  for (; to < count_ && touches(range, at[to]); ++to) {
    range.first = std::min(range.first, at[to].first);
    range.last = std::max(range.last, at[to].last);
  }
  if (to == from) {
    const std::span<VersionRange> moved = at.subspan(from, count_ - from + 1);
    std::copy_backward(moved.begin(), moved.end() - 1, moved.end());
    ++count_;
  } else {
    const std::span<VersionRange> all = at.first(count_);
    std::copy(all.begin() + static_cast<std::ptrdiff_t>(to), all.end(),
              all.begin() + static_cast<std::ptrdiff_t>(from) + 1);
    count_ -= to - from - 1;
  }
  at[from] = range;
  if (count_ < at.size()) {
    give_back();
    return true;
  }
  const std::span<VersionRange> all = at.first(count_);
  const auto shortest =
      std::min_element(all.begin(), all.end(), [](const VersionRange& a, const VersionRange& b) {
        return a.last - a.first < b.last - b.first;
      });
  std::copy(shortest + 1, all.end(), shortest);
  --count_;
  return contains(range);
}

void Coverage::trim(std::uint32_t last) noexcept {
  const std::span<VersionRange> at = places();
  while (count_ != 0 && at[count_ - 1].first > last) --count_;
  if (count_ != 0) at[count_ - 1].last = std::min(at[count_ - 1].last, last);
  give_back();
}

std::size_t Coverage::gaps(std::uint32_t last, std::span<VersionRange> into) const noexcept {
  std::size_t found = 0;
  std::uint32_t next = 1;
  for (const VersionRange& known : ranges()) {
    if (known.first > last) break;
    if (known.first > next) {
      if (found == into.size()) return found;
      into[found++] = {next, known.first - 1};
    }
    if (known.last >= last) return found;
    next = known.last + 1;
  }
  if (found < into.size() && next <= last) into[found++] = {next, last};
  return found;
}

}  // namespace tessera
