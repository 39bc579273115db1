// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/answers.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// A robot that was not heard before may ask for everything, and for a part of it again.
constexpr std::int64_t kFirstBytes = 256 << 10;
/// About what a record takes with its proof.
constexpr std::int64_t kRecordBytes = 256;

/// Gaps go before what is left of a long range that is being sent, and what was sent goes last.
bool goes_before(const Answers::Range& a, const Answers::Range& b) noexcept {
  constexpr std::uint32_t kShort = 128;
  if (a.again != b.again) return b.again;
  const bool a_is_short = a.range.last - a.range.first < kShort;
  const bool b_is_short = b.range.last - b.range.first < kShort;
  return a_is_short != b_is_short ? a_is_short : a.due < b.due;
}

}  // namespace

Result<Answers> Answers::make(Arena& arena, const ExchangeConfig& config) noexcept {
  Answers answers;
  answers.bytes_per_s_ = config.bytes_per_s;
  answers.ranges_ = arena.take<Range>(config.answers);
  answers.picks_.items = arena.take<Pick>(config.picks);
  answers.spans_.items = arena.take<Span>(kMostSpans);
  if (answers.ranges_.empty() || answers.picks_.items.empty() || answers.spans_.items.empty())
    return Status::kResourceExhausted;
  return answers;
}

/// What waits for the same robot is not asked for twice: a range grows at its end only, as what is
/// before it may be sent already, and whoever asks for all again and again would have the beginning
/// sent again and again.
bool Answers::add(const Range& wanted, ExchangeReport& counted) noexcept {
  Range rest = wanted;
  while (Range* const known = last_touching(rest)) {
    known->range.last = std::max(known->range.last, rest.range.last);
    if (rest.range.first >= known->range.first) return true;
    rest.range.last = known->range.first - 1;
    rest.again = true;
  }
  // One robot leaves places for others.
  const auto known = ranges_.first(range_count_);
  const auto its = std::count_if(known.begin(), known.end(),
                                 [&](const Range& range) { return range.asker == wanted.asker; });
  if (range_count_ == ranges_.size() || 4 * static_cast<std::size_t>(its) >= 3 * ranges_.size()) {
    ++counted.refused_answers;
    return false;
  }
  ranges_[range_count_++] = rest;
  return true;
}

/// Of the ranges that overlap it or end just before it, the one that begins last. A gap is none of
/// what comes last.
Answers::Range* Answers::last_touching(const Range& wanted) noexcept {
  Range* last = nullptr;
  for (Range& known : ranges_.first(range_count_)) {
    const bool apart =
        known.range.last + 1 < wanted.range.first || wanted.range.last < known.range.first;
    if (apart || known.asker != wanted.asker || known.contribution != wanted.contribution ||
        known.generation != wanted.generation || (known.again && !wanted.again))
      continue;
    if (last == nullptr || known.range.first > last->range.first) last = &known;
  }
  return last;
}

bool Answers::touches(std::uint32_t contribution, const VersionRange& range) const noexcept {
  const auto known = ranges_.first(range_count_);
  return std::any_of(known.begin(), known.end(), [&](const Range& one) {
    return one.contribution == contribution && one.range.first <= range.last &&
           range.first <= one.range.last;
  });
}

std::size_t Answers::drop(std::uint32_t contribution, VersionRange sent) noexcept {
  std::size_t changed = 0;
  for (std::size_t i = 0; i < range_count_;) {
    VersionRange& range = ranges_[i].range;
    const bool apart = sent.last < range.first || range.last < sent.first;
    if (ranges_[i].contribution == contribution && !apart) {
      const VersionRange before = range;
      if (sent.first <= range.first) {
        range.first = sent.last + 1;
        if (sent.last >= range.last) range = {};
      } else if (sent.last >= range.last) {
        range.last = sent.first - 1;
      }
      changed += range == before ? 0U : 1U;
    }
    if (range.first > range.last) {
      remove(ranges_[i]);
    } else {
      ++i;
    }
  }
  return changed;
}

/// Who lacks little goes before who asks for everything again: first the robot that has most of its
/// allowance left when it has all that it waits for.
Answers::Range* Answers::next(PeerTable& peers, Instant now) noexcept {
  for (Peer& peer : peers.all()) peer.waiting_bytes = 0;
  const auto ranges = ranges_.first(range_count_);
  for (const Range& range : ranges) {
    if (Peer* const peer = peers.find(range.asker); peer != nullptr)
      peer->waiting_bytes +=
          kRecordBytes * std::min<std::int64_t>(
                             range.held, std::int64_t{range.range.last} - range.range.first + 1);
  }
  Range* first = nullptr;
  std::int64_t left = 0;
  for (Range& range : ranges) {
    if (range.due > now) continue;
    const Peer* const peer = peers.find(range.asker);
    const std::int64_t its = peer == nullptr ? 0 : peer->allowance_bytes - peer->waiting_bytes;
    if (first != nullptr && (its < left || (its == left && !goes_before(range, *first)))) continue;
    first = &range;
    left = its;
  }
  return first;
}

bool Answers::may_ask(Peer& peer, const Ledger& ledger, Instant now) const noexcept {
  const std::uint64_t taken = ledger.records().taken_bytes();
  const auto most = static_cast<std::int64_t>(2 * ledger.held_bytes()) + kFirstBytes;
  std::int64_t left_us = 0;
  if (peer.allowance_at == Instant::long_ago()) {
    peer.allowance_bytes = most;
  } else {
    const std::int64_t rate = std::max<std::int64_t>(bytes_per_s_ / kRepeatShare, 1);
    const std::int64_t elapsed_us =
        std::clamp<std::int64_t>((now - peer.allowance_at).us, 0, 60'000'000);
    const std::int64_t earned = elapsed_us * rate / 1'000'000;
    const auto grown = static_cast<std::int64_t>(2 * (taken - peer.allowance_taken));
    peer.allowance_bytes = std::min(most, peer.allowance_bytes + grown + earned);
    // What is less than a byte stays time: who asks often loses nothing by it.
    left_us = elapsed_us - (earned * 1'000'000 + rate - 1) / rate;
  }
  peer.allowance_at = now + Duration{-left_us};
  peer.allowance_taken = taken;
  return peer.allowance_bytes > 0;
}

}  // namespace tessera
