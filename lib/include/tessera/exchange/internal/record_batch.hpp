// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Records that are sent next, by version: those of a range, or those that were published last.
#pragma once

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

/// Records of a contribution, as many of a range as fit.
struct RecordBatch {
  static constexpr std::size_t kMostParts = 128;
  /// A record that waits to be sent.
  struct Part {
    std::uint32_t record = 0;
    std::uint32_t version = 0;
  };
  std::uint32_t contribution = 0;
  std::uint32_t generation = 0;
  std::uint32_t asker = 0;
  VersionRange range;  ///< Of which these are all; what is left of it.
  std::array<Part, kMostParts> parts{};
  std::size_t count = 0;
  std::size_t next = 0;

  [[nodiscard]] bool empty() const noexcept { return range.first > range.last; }
  /// Takes the parts of the lowest versions in the range; if there are more than it holds, the
  /// range ends with the last of them. Versions are all different, but for what one who has the key
  /// makes up: so many of one version that they do not fit are cut short. Returns how many records
  /// it looked at. O(records in the range, and kMostParts more).
  std::size_t collect(const Ledger& ledger) noexcept;
};

/// Records that were published and have not gone out: a ring, in the order of versions, up to the
/// latest.
class FreshRecords {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t most) noexcept {
    return arena_bytes<Fresh>(most);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<FreshRecords> make(Arena& arena, std::uint32_t most) noexcept {
    FreshRecords made;
    made.fresh_ = arena.take<Fresh>(most);
    if (made.fresh_.empty()) return Status::kResourceExhausted;
    return made;
  }
  FreshRecords() noexcept = default;

  /// Where there is no room the oldest are forgotten.
  void note(BlockKey key, VersionRange versions) noexcept;
  void clear() noexcept { first_ = count_ = 0; }
  /// As RecordBatch::collect, of the range's records: O(kMostParts), or what that takes where more
  /// waits than is noted.
  void collect(const Ledger& ledger, RecordBatch& batch) noexcept;

 private:
  struct Fresh {
    BlockKey key{};
    std::uint32_t version = 0;
  };
  void drop_first() noexcept {
    first_ = (first_ + 1) % fresh_.size();
    --count_;
  }

  std::span<Fresh> fresh_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace tessera
