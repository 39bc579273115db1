// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The undiffused sums of the blocks that are part of the graph, packed.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/map/block_content.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/replica/internal/segment_store.hpp"

namespace tessera {

/// Names what is stored of one block.
struct StoredBytes {
  SegmentStore::Chain chain = 0;
  std::uint32_t bytes = 0;
  [[nodiscard]] bool any() const noexcept { return chain != 0; }
};
/// The sums of one.
struct StoredSums : StoredBytes {
  std::uint64_t classes = 0;  ///< With evidence, a bit each.
};

class SumStore {
 public:
  /// What became of sums that were to be kept.
  enum class Kept : std::uint8_t { kAsBefore, kAnew, kNoRoom };

  /// scratch: for one packed block. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<SumStore> make(Arena& arena, std::uint32_t segments,
                                             std::span<std::byte> scratch) noexcept {
    Result<SegmentStore> segments_made = SegmentStore::make(arena, segments);
    if (!segments_made.ok()) return segments_made.status();
    SumStore made;
    made.segments_ = *segments_made;
    made.scratch_ = scratch;
    return made;
  }
  SumStore() noexcept = default;

  /// Replaces a block's sums; kNoRoom leaves them as they were. O(bytes).
  [[nodiscard]] Kept keep(StoredSums& sums, const BlockContent& content) noexcept {
    return keep(sums, scratch_.first(pack_block(content, scratch_)));
  }
  /// The same for any bytes, not none.
  [[nodiscard]] Kept keep(StoredBytes& stored, std::span<const std::byte> bytes) noexcept {
    if (is(stored, bytes)) return Kept::kAsBefore;
    const std::uint32_t held = SegmentStore::segments_of(stored.bytes);
    if (SegmentStore::segments_of(bytes.size()) > held + segments_.free_segments())
      return Kept::kNoRoom;
    segments_.release(stored.chain);
    stored.chain = *segments_.write(bytes);
    stored.bytes = static_cast<std::uint32_t>(bytes.size());
    return Kept::kAnew;
  }
  /// Whether these bytes are stored. O(bytes).
  [[nodiscard]] bool is(const StoredBytes& stored,
                        std::span<const std::byte> bytes) const noexcept {
    return stored.any() && stored.bytes == bytes.size() && segments_.equals(stored.chain, bytes);
  }
  void drop(StoredSums& sums) noexcept {
    drop(static_cast<StoredBytes&>(sums));
    sums.classes = 0;
  }
  void drop(StoredBytes& stored) noexcept {
    segments_.release(stored.chain);
    stored = {};
  }
  /// Packed, until the next call. O(bytes).
  [[nodiscard]] std::span<const std::byte> read(const StoredBytes& stored) noexcept {
    const std::span<std::byte> bytes = scratch_.first(stored.bytes);
    segments_.read(stored.chain, bytes);
    return bytes;
  }
  [[nodiscard]] std::size_t used_bytes() const noexcept {
    return std::size_t{segments_.used_segments()} * SegmentStore::kSegmentBytes;
  }

 private:
  SegmentStore segments_{};
  std::span<std::byte> scratch_;
};

}  // namespace tessera
