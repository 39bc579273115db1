// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/answers.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// A robot that was not heard before may ask for everything, and for a part of it again.
constexpr std::int64_t kFirstBytes = 256 << 10;

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

bool Answers::add(const Range& wanted, ExchangeReport& counted) noexcept {
  for (Range& known : ranges_.first(range_count_)) {
    const bool apart =
        wanted.range.last < known.range.first || known.range.last < wanted.range.first;
    if (known.contribution != wanted.contribution || known.generation != wanted.generation || apart)
      continue;
    known.range.first = std::min(known.range.first, wanted.range.first);
    known.range.last = std::max(known.range.last, wanted.range.last);
    known.asker = wanted.asker;
    return true;
  }
  if (range_count_ == ranges_.size()) {
    ++counted.refused_answers;
    return false;
  }
  ranges_[range_count_++] = wanted;
  return true;
}

void Answers::drop(std::uint32_t contribution, VersionRange heard,
                   ExchangeReport& counted) noexcept {
  for (std::size_t i = 0; i < range_count_;) {
    VersionRange& range = ranges_[i].range;
    const bool apart = heard.last < range.first || range.last < heard.first;
    if (ranges_[i].contribution == contribution && !apart) {
      const VersionRange before = range;
      if (heard.first <= range.first) {
        range.first = heard.last + 1;
        if (heard.last >= range.last) range = {};
      } else if (heard.last >= range.last) {
        range.last = heard.first - 1;
      }
      counted.answers_saved += range == before ? 0U : 1U;
    }
    if (range.first > range.last) {
      remove(ranges_[i]);
    } else {
      ++i;
    }
  }
}

Answers::Range* Answers::first_due(Instant now) noexcept {
  Range* first = nullptr;
  for (Range& range : ranges_.first(range_count_)) {
    if (range.due <= now && (first == nullptr || range.due < first->due)) first = &range;
  }
  return first;
}

bool Answers::may_ask(Peer& peer, const Ledger& ledger, Instant now) const noexcept {
  const std::uint64_t taken = ledger.taken_bytes();
  const auto most = static_cast<std::int64_t>(2 * taken) + kFirstBytes;
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
