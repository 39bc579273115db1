// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Bytes of any length in fixed memory: chains of segments of one size, so that what fits depends on
// how much is stored and never on the order in which it came.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/status.hpp"

namespace tessera {

class SegmentStore {
 public:
  static constexpr std::size_t kSegmentBytes = 128;
  /// Of a segment, beside the link to the next one.
  static constexpr std::size_t kPayloadBytes = kSegmentBytes - sizeof(std::uint32_t);
  /// Names a chain: its first segment plus one; 0 is none.
  using Chain = std::uint32_t;

  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t segments) noexcept {
    return arena_bytes<Segment>(segments);
  }
  /// Fails with kResourceExhausted iff the arena is too small. O(1): memory is not touched.
  [[nodiscard]] static Result<SegmentStore> make(Arena& arena, std::uint32_t segments) noexcept {
    const std::span<std::byte> memory = arena.take_untouched(required_bytes(segments));
    if (memory.empty()) return Status::kResourceExhausted;
    SegmentStore store;
    store.segments_ = reinterpret_cast<Segment*>(memory.data());
    store.capacity_ = segments;
    return store;
  }
  SegmentStore() noexcept = default;

  [[nodiscard]] static constexpr std::uint32_t segments_of(std::size_t bytes) noexcept {
    return static_cast<std::uint32_t>((bytes + kPayloadBytes - 1) / kPayloadBytes);
  }
  /// Stores bytes, and more after them, not both none. Fails with kResourceExhausted iff
  /// free_segments() are too few; nothing was changed. O(bytes).
  [[nodiscard]] Result<Chain> write(std::span<const std::byte> bytes,
                                    std::span<const std::byte> more = {}) noexcept {
    if (segments_of(bytes.size() + more.size()) > free_segments())
      return Status::kResourceExhausted;
    Chain first = 0;
    std::uint32_t* link = &first;
    std::size_t used = kPayloadBytes;
    Segment* segment = nullptr;
    for (std::span<const std::byte> rest : {bytes, more}) {
      while (!rest.empty()) {
        if (used == kPayloadBytes) {
          *link = take();
          segment = &at(*link);
          link = &segment->next;
          used = 0;
        }
        const std::size_t part = std::min(rest.size(), kPayloadBytes - used);
        std::memcpy(segment->payload.data() + used, rest.data(), part);
        rest = rest.subspan(part);
        used += part;
      }
    }
    *link = 0;
    return first;
  }
  /// Copies into.size() bytes of a chain from offset on, all of which it must have. O(offset +
  /// bytes).
  void read(Chain chain, std::span<std::byte> into, std::size_t offset = 0) const noexcept {
    for (; offset >= kPayloadBytes && !into.empty(); offset -= kPayloadBytes)
      chain = at(chain).next;
    while (!into.empty()) {
      const Segment& segment = at(chain);
      chain = segment.next;
      const std::size_t part = std::min(into.size(), kPayloadBytes - offset);
      std::memcpy(into.data(), segment.payload.data() + offset, part);
      into = into.subspan(part);
      offset = 0;
    }
  }
  /// True iff the chain starts with these bytes. O(bytes).
  [[nodiscard]] bool equals(Chain chain, std::span<const std::byte> bytes) const noexcept {
    while (!bytes.empty()) {
      const Segment& segment = at(chain);
      chain = segment.next;
      const std::size_t part = bytes.size() < kPayloadBytes ? bytes.size() : kPayloadBytes;
      if (std::memcmp(bytes.data(), segment.payload.data(), part) != 0) return false;
      bytes = bytes.subspan(part);
    }
    return true;
  }
  /// Gives a chain back; 0 is none. O(segments).
  void release(Chain chain) noexcept {
    while (chain != 0) {
      Segment& segment = at(chain);
      const Chain next = segment.next;
      segment.next = released_;
      released_ = chain;
      --used_;
      chain = next;
    }
  }

  [[nodiscard]] std::uint32_t used_segments() const noexcept { return used_; }
  [[nodiscard]] std::uint32_t free_segments() const noexcept { return capacity_ - used_; }

 private:
  struct Segment {
    std::array<std::byte, kPayloadBytes> payload;
    std::uint32_t next;
  };
  static_assert(sizeof(Segment) == kSegmentBytes);

  [[nodiscard]] Segment& at(Chain chain) const noexcept {
    TESSERA_ASSERT(chain != 0 && chain <= capacity_);
    return segments_[chain - 1];
  }
  std::uint32_t take() noexcept {
    ++used_;
    if (released_ == 0) return ++fresh_;
    const std::uint32_t taken = released_;
    released_ = at(taken).next;
    return taken;
  }

  Segment* segments_ = nullptr;
  std::uint32_t capacity_ = 0;
  std::uint32_t used_ = 0;
  std::uint32_t fresh_ = 0;  ///< Segments that were ever taken.
  Chain released_ = 0;
};

}  // namespace tessera
