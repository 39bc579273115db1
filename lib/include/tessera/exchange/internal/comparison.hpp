// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Finds in which records of a contribution this robot differs from another one: range-based set
// reconciliation over versions (Meyer, SRDS 2023). The other robot describes a span of versions by
// sums of its parts; the parts with other sums are asked for in turn, down to lists of records. So
// k differences among n records take O(log n) exchanges and O(k) bytes, whatever their places, and
// a step that is lost is asked for again alone. The other robot keeps no state for it.
#pragma once

#include <optional>

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

class Comparison {
 public:
  /// Spans that are to be described, at most. What finds no place is left to the next comparison.
  static constexpr std::size_t kMostNodes = 4096;
  static constexpr std::size_t kMostWanted = 1024;
  /// Then it is another one's turn.
  static constexpr Duration kLongest{60'000'000};

  /// Of what differs.
  struct Difference {
    std::uint32_t sends = 0;  ///< Records that this robot has to send.
    std::uint32_t wants = 0;  ///< That it has to get.
  };

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<Node>(kMostNodes) + arena_bytes<std::uint32_t>(kMostWanted) +
           arena_bytes<VersionRange>(kMostGaps) + arena_bytes<Description::Mark>(kMostOwn) +
           arena_bytes<std::uint64_t>(Description::kMostSums);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Comparison> make(Arena& arena) noexcept;
  Comparison() noexcept = default;

  /// Compares a contribution with what a robot holds. latest: the highest version of both.
  void begin(const Ledger& ledger, const Ledger::Contribution& contribution, std::uint32_t robot,
             std::uint32_t latest, Instant now) noexcept;
  void end() noexcept { active_ = false; }
  /// Records of the contribution came: what is awaited may be among them, or behind them.
  void note_taken(std::uint32_t sender, Instant now) noexcept {
    heard_ = now;
    took_ = took_ || sender == robot_;
  }
  /// True if any came from the other robot since it began.
  [[nodiscard]] bool took() const noexcept { return took_; }
  [[nodiscard]] Instant began() const noexcept { return began_; }
  [[nodiscard]] bool active() const noexcept { return active_; }
  [[nodiscard]] bool is_of(std::uint32_t number, std::uint32_t generation) const noexcept {
    return active_ && number == number_ && generation == generation_;
  }
  [[nodiscard]] std::uint32_t number() const noexcept { return number_; }
  [[nodiscard]] std::uint32_t robot() const noexcept { return robot_; }
  /// Whose descriptions are waited for, if anybody's.
  [[nodiscard]] std::optional<std::uint32_t> describing() const noexcept {
    return active_ ? std::optional(robot_) : std::nullopt;
  }
  /// True once nothing is left to ask or to wait for, or the other robot does not answer any more.
  /// What is to be asked again is noted. O(spans), and for those whose records were awaited
  /// O(records in them).
  [[nodiscard]] bool is_over(const Ledger& ledger, const Ledger::Contribution& contribution,
                             Instant now) noexcept;
  /// True if it is over and something was left to ask: a difference may remain.
  [[nodiscard]] bool gave_up() const noexcept { return gave_up_; }
  /// True if it found a difference.
  [[nodiscard]] bool found() const noexcept { return found_; }

  /// What is to be asked next: fills type, target, count and what follows. False: nothing now.
  [[nodiscard]] bool write_next(RequestedContribution& requested) noexcept;
  /// Takes a description of the contribution by the robot. send(version) is called for each record
  /// that this robot has to send to it, send_range(range) for all of a range. O(records in the span
  /// + parts).
  template <class Send, class SendRange>
  void hear(const Ledger& ledger, const Ledger::Contribution& contribution,
            const Description& description, Instant now, Send&& send,
            SendRange&& send_range) noexcept {
    if (visited_ > kMostVisited) return;
    // A list that would be wanted more of than there is room for is asked for again.
    const bool has_room = wanted_count_ + Description::kMostRecords <= wanted_.size();
    Node node;
    if (!take_node(description.span, !description.is_list || has_room, node)) return;
    heard_ = now;
    tries_ = 0;
    if (!description.is_list) {
      add_parts(ledger, contribution, description, node, send_range);
      return;
    }
    std::uint32_t last = description.last;
    const auto own = list_own(ledger, contribution, description.span, last);
    const std::size_t wanted_before = wanted_count_;
    const bool same = merge(description, own, last, send);
    // Sums tell more of contents apart than marks do: both get both, if new sums say so again,
    // which are asked for when all else is done.
    const bool suspect = same && node.sum_known && last >= range_of(node.span).last &&
                         node.their_sum != sum_of(ledger, contribution, node.span);
    if (suspect && !node.suspect) {
      doubts_ = true;
    } else if (suspect && node.awaited == 0) {
      found_ = true;
      for (const Description::Mark& one : own) {
        send(one.version);
        want(one.version);
      }
    }
    // Of a list that left something out the rest is asked for, not the whole again.
    if (!add_rest(description.span, last) && wanted_count_ != wanted_before) await(node);
  }
  /// What a robot holds of a span, if it is described as it should be. Fills all but id and target.
  /// Returns how many records were looked at.
  static std::size_t describe(const Ledger& ledger, const Ledger::Contribution& contribution,
                              VersionSpan span, Description& description) noexcept;

 private:
  enum class State : std::uint8_t {
    kToAsk,
    kAsked,
    kAwaited,  ///< It was described, and what this robot lacks of it is asked for.
  };
  struct Node {
    VersionSpan span;
    State state = State::kToAsk;
    std::uint8_t awaited = 0;  ///< Times.
    bool sum_known = false;
    bool suspect = false;         ///< Contents with unequal sums had equal marks.
    std::uint64_t their_sum = 0;  ///< Of what the other robot holds of it.
  };
  static constexpr std::size_t kMostOwn = 1024;

  static constexpr std::size_t kMostGaps = RequestedContribution::kMostGaps;
  /// Records that are looked at: where one bucket of the index has all of them, each span is a
  /// walk.
  static constexpr std::size_t kMostVisited = 5'000'000;

  /// False: it was not asked for, or is to be asked for again.
  [[nodiscard]] bool take_node(const VersionSpan& span, bool has_room, Node& taken) noexcept;
  void add_node(const Node& node) noexcept;
  /// Has it described again if what was asked for does not come.
  void await(Node node) noexcept;
  [[nodiscard]] std::uint64_t sum_of(const Ledger& ledger, const Ledger::Contribution& contribution,
                                     const VersionSpan& span) noexcept;
  /// Of each part of what is described. Returns how many records were looked at.
  static std::size_t sum_parts(const Ledger& ledger, const Ledger::Contribution& contribution,
                               const Description& description,
                               std::span<std::uint64_t> sums) noexcept;
  [[nodiscard]] bool add_gap(const VersionSpan& span) noexcept;
  /// Of a part that one of the two has nothing of, the other one's records are sent as a range.
  template <class SendRange>
  void add_parts(const Ledger& ledger, const Ledger::Contribution& contribution,
                 const Description& description, const Node& whole,
                 SendRange&& send_range) noexcept {
    const unsigned bits = description.span.width - description.part_width;
    visited_ += sum_parts(ledger, contribution, description, part_sums_);
    for (std::uint32_t part = 0; part < description.count; ++part) {
      const VersionSpan span{description.part_width, (description.span.index << bits) + part};
      const std::uint64_t own = part_sums_[part];
      const std::uint64_t theirs = description.sum[part];
      if (own == theirs || span.first() > kLastVersion) continue;
      found_ = found_ || own == 0 || theirs == 0;
      const Node node{.span = span,
                      .awaited = whole.awaited,
                      .sum_known = true,
                      .suspect = whole.suspect,
                      .their_sum = theirs};
      if (own == 0 && add_gap(span)) {
        await(node);
      } else if (theirs != 0 || !send_range(range_of(span))) {
        add_node(node);
      }
    }
  }
  [[nodiscard]] static VersionRange range_of(const VersionSpan& span) noexcept {
    const std::uint64_t last = span.last() < kLastVersion ? span.last() : kLastVersion;
    return {static_cast<std::uint32_t>(span.first()), static_cast<std::uint32_t>(last)};
  }
  /// False: there is none.
  bool add_rest(const VersionSpan& span, std::uint32_t last) noexcept;
  [[nodiscard]] std::span<const Description::Mark> list_own(
      const Ledger& ledger, const Ledger::Contribution& contribution, const VersionSpan& span,
      std::uint32_t& last) noexcept;
  void want(std::uint32_t version) noexcept;

  /// Of two marks of one version. Layers that are no longer live follow from other records: both
  /// get both.
  template <class Send>
  void settle(const Description::Mark& own, const Description::Mark& theirs, Send&& send) noexcept {
    const bool several = is_of_several(own.mark) || is_of_several(theirs.mark);
    if (several || own.mark <= (theirs.mark | 0xfU)) send(own.version);
    if (several || theirs.mark <= (own.mark | 0xfU)) want(theirs.version);
    found_ = true;
  }
  /// Of one version the content with the lower hash counts, hence the lower mark. True iff nothing
  /// differs.
  template <class Send>
  bool merge(const Description& description, std::span<const Description::Mark> own,
             std::uint32_t last, Send&& send) noexcept {
    const auto theirs = std::span(description.record).first(description.count);
    std::size_t i = 0;
    std::size_t j = 0;
    bool same = true;
    while (true) {
      const bool has_own = i < own.size() && own[i].version <= last;
      const bool has_their = j < theirs.size() && theirs[j].version <= last;
      if (!has_own && !has_their) return same;
      if (has_own && has_their && own[i].version == theirs[j].version) {
        const bool differ = own[i].mark != theirs[j].mark;
        if (differ) settle(own[i], theirs[j], send);
        same = same && !differ;
        ++i;
        ++j;
        continue;
      }
      same = false;
      found_ = true;
      if (has_own && (!has_their || own[i].version < theirs[j].version)) {
        send(own[i++].version);
      } else {
        want(theirs[j++].version);
      }
    }
  }

  bool active_ = false;
  bool found_ = false;
  bool gave_up_ = false;
  bool took_ = false;
  bool doubts_ = false;      ///< A list had equal marks, and another sum before.
  std::size_t visited_ = 0;  ///< Records that were looked at in this robot's own replica.
  std::uint32_t number_ = 0;
  std::uint32_t generation_ = 0;
  std::uint32_t robot_ = 0;
  std::uint32_t tries_ = 0;
  VersionSpan whole_{};  ///< What it began with.
  Instant began_;
  Instant heard_;  ///< When something came of it last, or it began.
  std::span<Node> nodes_;
  std::size_t node_count_ = 0;
  std::span<std::uint32_t> wanted_;
  std::size_t wanted_count_ = 0;
  std::span<VersionRange> gaps_;  ///< Of which this robot has nothing.
  std::size_t gap_count_ = 0;
  std::span<Description::Mark> own_;    ///< Scratch: records of a span.
  std::span<std::uint64_t> part_sums_;  ///< Scratch.
};

}  // namespace tessera
