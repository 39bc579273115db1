// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which versions of a contribution a robot lacks nothing of: it has them, or knows of later ones of
// the same blocks. A union of ranges: what is heard twice changes nothing, and the order does not
// matter. Kept in fixed memory; what does not fit is forgotten, and heard again. A few ranges are
// in the coverage itself; where it has more, it has a part of a pool that all contributions share.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/base/internal/part_pool.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {

class Coverage {
 public:
  /// At loss of a third, what a robot says in a second leaves some hundred gaps.
  static constexpr std::size_t kMostRanges = 1024;
  /// Without a part of the pool.
  static constexpr std::size_t kFewRanges = 31;
  /// One more than there may be, while a range is added.
  using Part = std::array<VersionRange, kMostRanges + 1>;

  /// The pool, before anything is added. It must outlive the coverage.
  void use(PartPool<Part>& pool) noexcept { pool_ = &pool; }

  /// Adds range.first .. range.last, from 1. Where there would be too many ranges, the shortest is
  /// forgotten. True iff anything new is covered. O(kMostRanges).
  bool add(VersionRange range) noexcept;
  void clear() noexcept {
    count_ = 0;
    give_back();
  }
  /// Forgets what is beyond version last.
  void trim(std::uint32_t last) noexcept;
  /// Whether all of it is covered.
  [[nodiscard]] bool contains(VersionRange range) const noexcept;
  /// How many of these versions are not covered. O(kMostRanges).
  [[nodiscard]] std::uint32_t lacking(VersionRange range) const noexcept;
  /// All up to this version is covered, and the next one is not.
  [[nodiscard]] std::uint32_t complete_to() const noexcept {
    const std::span<const VersionRange> all = ranges();
    return !all.empty() && all.front().first == 1 ? all.front().last : 0;
  }
  /// Ascending, with a gap between any two.
  [[nodiscard]] std::span<const VersionRange> ranges() const noexcept {
    return (part_ == 0 ? std::span<const VersionRange>(few_) : pool_->at(part_)).first(count_);
  }
  /// Those from the first that ends at version or after it. O(log kMostRanges).
  [[nodiscard]] std::span<const VersionRange> ranges_from(std::uint32_t version) const noexcept;
  /// The first of the gaps up to version last, in into. Returns how many.
  std::size_t gaps(std::uint32_t last, std::span<VersionRange> into) const noexcept;

 private:
  /// All places for ranges.
  [[nodiscard]] std::span<VersionRange> places() noexcept {
    return part_ == 0 ? std::span<VersionRange>(few_) : pool_->at(part_);
  }
  [[nodiscard]] std::span<VersionRange> taken_places() noexcept;
  void give_back() noexcept;

  std::array<VersionRange, kFewRanges + 1> few_{};
  std::size_t count_ = 0;
  std::uint16_t part_ = 0;  ///< Number in the pool; 0: few_ has all.
  PartPool<Part>* pool_ = nullptr;
};

}  // namespace tessera
