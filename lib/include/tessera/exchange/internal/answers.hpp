// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What other robots asked for and is still to be sent: ranges of versions, single records,
// descriptions. What one robot may cause is bounded: it gets what there is about twice, and beyond
// that a small share of this robot's rate.
#pragma once

#include <algorithm>

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

class Answers {
 public:
  /// Of bytes_per_s, what a robot gets that has had everything.
  static constexpr std::int64_t kRepeatShare = 25;  // 1 / 25: 4 %

  /// Versions that somebody asked for, and this robot has.
  struct Range {
    std::uint32_t contribution = 0;
    std::uint32_t generation = 0;
    VersionRange range;  ///< What is left of it.
    Instant due;
    std::uint32_t asker = 0;
    std::uint32_t held = kLastVersion;  ///< Records of the contribution here: there are no more.
    /// It was asked for with what still waits, and went out before that: it comes last.
    bool again = false;
  };
  /// A record that somebody asked for by its version, or lacks.
  struct Pick {
    std::uint32_t contribution = 0;
    std::uint32_t generation = 0;
    std::uint32_t version = 0;
    std::uint32_t asker = 0;
    std::uint32_t place = 0;  ///< Which one, where several blocks have this version.
  };
  /// A span that somebody asked to be described.
  struct Span {
    std::uint32_t contribution = 0;
    std::uint32_t generation = 0;
    std::uint32_t asker = 0;
    VersionSpan span;
  };
  /// A ring of fixed size, of which one robot leaves a quarter for others.
  template <class T>
  struct Ring {
    std::span<T> items;
    std::size_t first = 0;
    std::size_t count = 0;
    /// How many more one robot may have in it. O(1) while the ring is nearly empty, else O(count).
    [[nodiscard]] std::size_t room_for(std::uint32_t asker) const noexcept {
      const std::size_t share = items.size() - items.size() / 4;
      if (count <= items.size() / 4) return share - count;
      std::size_t its = 0;
      for (std::size_t i = 0; i < count; ++i)
        its += items[(first + i) % items.size()].asker == asker ? 1U : 0U;
      return share - std::min(share, its);
    }
    [[nodiscard]] bool push(const T& item) noexcept {
      if (count == items.size()) return false;
      items[(first + count++) % items.size()] = item;
      return true;
    }
    [[nodiscard]] T& front() noexcept { return items[first]; }
    void pop() noexcept {
      first = (first + 1) % items.size();
      --count;
    }
  };

  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return arena_bytes<Range>(config.answers) + arena_bytes<Pick>(config.picks) +
           arena_bytes<Span>(kMostSpans);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Answers> make(Arena& arena, const ExchangeConfig& config) noexcept;
  Answers() noexcept = default;

  /// False iff there is no place: it will be asked for again.
  [[nodiscard]] bool add(const Range& wanted, ExchangeReport& counted) noexcept;
  /// What was sent, by this robot or another, needs no sending to anybody. Returns how many ranges
  /// are shorter by it.
  std::size_t drop(std::uint32_t contribution, VersionRange sent) noexcept;
  /// Of the ranges that are due one of the robot that will have most of its allowance left, short
  /// ones first, then as they were due; or null. O(answers * peers).
  [[nodiscard]] Range* next(PeerTable& peers, Instant now) noexcept;
  void remove(Range& range) noexcept { range = ranges_[--range_count_]; }
  [[nodiscard]] Ring<Pick>& picks() noexcept { return picks_; }
  [[nodiscard]] Ring<Span>& spans() noexcept { return spans_; }
  [[nodiscard]] std::size_t waiting() const noexcept {
    return range_count_ + picks_.count + spans_.count;
  }
  [[nodiscard]] static constexpr std::size_t most_waiting(const ExchangeConfig& config) noexcept {
    return std::size_t{config.answers} + config.picks + kMostSpans;
  }

  /// True if something of these versions waits.
  [[nodiscard]] bool touches(std::uint32_t contribution, const VersionRange& range) const noexcept;
  /// True if a robot may cause more to be sent. Brings its allowance up to date.
  [[nodiscard]] bool may_ask(Peer& peer, const Ledger& ledger, Instant now) const noexcept;
  /// Charges what was sent for a robot.
  static void charge(Peer& peer, std::size_t bytes) noexcept {
    peer.allowance_bytes -= static_cast<std::int64_t>(bytes);
  }

 private:
  static constexpr std::size_t kMostSpans = 2048;
  [[nodiscard]] Range* last_touching(const Range& wanted) noexcept;
  std::int64_t bytes_per_s_ = 0;
  std::span<Range> ranges_;
  std::size_t range_count_ = 0;
  Ring<Pick> picks_{};
  Ring<Span> spans_{};
};

}  // namespace tessera
