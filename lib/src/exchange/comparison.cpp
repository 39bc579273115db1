// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/comparison.hpp"

#include <algorithm>
#include <bit>

#include "list_marks.hpp"

namespace tessera {

namespace {

/// Without an answer for so long what was asked is asked again, so many times: where seven of ten
/// datagrams are lost, two of three questions are answered.
constexpr Duration kAnswerTime{500'000};
constexpr std::uint32_t kMostTries = 12;
/// Descriptions that are heard of a span whose records do not come.
constexpr std::uint8_t kMostAwaited = 8;
/// A span is described by up to 2^6 sums.
constexpr unsigned kPartBits = 6;

/// Without recursion.
template <class T, class Less = std::less<>>
void heap_sort(std::span<T> items, Less less = {}) noexcept {
  std::make_heap(items.begin(), items.end(), less);
  std::sort_heap(items.begin(), items.end(), less);
}

}  // namespace

Result<Comparison> Comparison::make(Arena& arena) noexcept {
  Comparison made;
  made.nodes_ = arena.take<Node>(kMostNodes);
  made.wanted_ = arena.take<std::uint32_t>(kMostWanted);
  made.gaps_ = arena.take<VersionRange>(kMostGaps);
  made.own_ = arena.take<Description::Mark>(kMostOwn);
  made.part_sums_ = arena.take<std::uint64_t>(Description::kMostSums);
  if (made.nodes_.empty() || made.wanted_.empty() || made.gaps_.empty() || made.own_.empty() ||
      made.part_sums_.empty())
    return Status::kResourceExhausted;
  return made;
}

void Comparison::begin(const Ledger& ledger, const Ledger::Contribution& contribution,
                       std::uint32_t robot, std::uint32_t latest, Instant now) noexcept {
  active_ = true;
  found_ = took_ = gave_up_ = doubts_ = false;
  number_ = ledger.number_of(contribution);
  generation_ = contribution.generation;
  robot_ = robot;
  tries_ = 0;
  visited_ = 0;
  began_ = heard_ = now;
  node_count_ = wanted_count_ = gap_count_ = 0;
  std::uint8_t width = std::max<std::uint8_t>(1, contribution.index.width());
  while (width < 32 && (std::uint64_t{1} << width) < latest) ++width;
  // Records above what either stated are found as well.
  while (width < 32 &&
         (std::uint64_t{VersionIndex::kBuckets} << contribution.index.width()) >
             (std::uint64_t{1} << width) &&
         contribution.index.sum({width, 0}) != contribution.index.sum({32, 0}))
    ++width;
  whole_ = {width, 0};
  add_node({.span = whole_});
}

bool Comparison::is_over(const Ledger& ledger, const Ledger::Contribution& contribution,
                         Instant now) noexcept {
  if (!active_) return true;
  if (node_count_ == 0 && wanted_count_ == 0 && gap_count_ == 0) {
    // Most sums were other ones only because records came between them and the lists.
    if (!doubts_) return true;
    doubts_ = false;
    add_node({.span = whole_, .suspect = true});
  }
  gave_up_ = now - began_ > kLongest || visited_ > kMostVisited;
  if (gave_up_ || now - heard_ < kAnswerTime) return gave_up_;
  gave_up_ = ++tries_ >= kMostTries;
  heard_ = now;
  for (std::size_t i = 0; i < node_count_ && visited_ <= kMostVisited;) {
    Node& node = nodes_[i];
    const bool awaited = node.state == State::kAwaited;
    const std::uint64_t own = awaited ? sum_of(ledger, contribution, node.span) : 0;
    const bool came = awaited && node.sum_known && own == node.their_sum;
    // Without a record of it there is nothing to compare: all of it is asked for again.
    const bool again =
        awaited && !came && own == 0 && node.awaited < kMostAwaited && add_gap(node.span);
    node.awaited = static_cast<std::uint8_t>(node.awaited + (again ? 1 : 0));
    node.state = again ? State::kAwaited : State::kToAsk;
    if (came) {
      node = nodes_[--node_count_];
    } else {
      ++i;
    }
  }
  return gave_up_ || (node_count_ == 0 && wanted_count_ == 0 && gap_count_ == 0);
}

void Comparison::add_node(const Node& node) noexcept {
  if (node_count_ < nodes_.size()) nodes_[node_count_++] = node;
}

void Comparison::await(Node node) noexcept {
  if (++node.awaited > kMostAwaited) return;
  node.state = State::kAwaited;
  add_node(node);
}

bool Comparison::take_node(const VersionSpan& span, bool has_room, Node& taken) noexcept {
  for (std::size_t i = 0; i < node_count_; ++i) {
    if (!(nodes_[i].span == span) || nodes_[i].state != State::kAsked) continue;
    nodes_[i].state = has_room ? State::kAsked : State::kToAsk;
    if (!has_room) return false;
    taken = nodes_[i];
    nodes_[i] = nodes_[--node_count_];
    return true;
  }
  return false;
}

void Comparison::want(std::uint32_t version) noexcept {
  if (wanted_count_ < wanted_.size()) wanted_[wanted_count_++] = version;
}

/// Also of a span that is narrower than a bucket.
std::uint64_t Comparison::sum_of(const Ledger& ledger, const Ledger::Contribution& contribution,
                                 const VersionSpan& span) noexcept {
  if (span.width >= contribution.index.width()) return contribution.index.sum(span);
  std::uint64_t sum = 0;
  const VersionRange range = range_of(span);
  visited_ += contribution.index.visit(
      ledger.records().links(), range,
      [&](std::uint32_t number) {
        const Replicas::Replica& part = ledger.replicas().record(number);
        if (part.version >= range.first && part.version <= range.last)
          sum += fingerprint_of(part.hash, part.live).low;
      },
      [](std::uint32_t) { return true; });
  return sum;
}

/// In one walk, also where one bucket has them all.
std::size_t Comparison::sum_parts(const Ledger& ledger, const Ledger::Contribution& contribution,
                                  const Description& description,
                                  std::span<std::uint64_t> sums) noexcept {
  const std::uint32_t first_part = description.span.index
                                   << (description.span.width - description.part_width);
  if (description.part_width >= contribution.index.width()) {
    for (std::uint32_t part = 0; part < description.count; ++part)
      sums[part] = contribution.index.sum({description.part_width, first_part + part});
    return 0;
  }
  std::fill_n(sums.begin(), description.count, 0);
  const VersionRange range = range_of(description.span);
  return contribution.index.visit(
      ledger.records().links(), range,
      [&](std::uint32_t number) {
        const Replicas::Replica& part = ledger.replicas().record(number);
        if (part.version < range.first || part.version > range.last) return;
        sums[((part.version - 1) >> description.part_width) - first_part] +=
            fingerprint_of(part.hash, part.live).low;
      },
      [](std::uint32_t) { return true; });
}

/// Gaps that touch become one. False iff there is no place, or no version is in the span.
bool Comparison::add_gap(const VersionSpan& span) noexcept {
  const VersionRange range = range_of(span);
  if (range.first > range.last) return false;
  for (VersionRange& gap : gaps_.first(gap_count_)) {
    if (gap.first <= range.first && range.last <= gap.last) return true;
    if (gap.last + 1 != range.first) continue;
    gap.last = range.last;
    return true;
  }
  if (gap_count_ == gaps_.size()) return false;
  gaps_[gap_count_++] = range;
  return true;
}

/// What a list left out is asked for by halves.
bool Comparison::add_rest(const VersionSpan& span, std::uint32_t last) noexcept {
  if (last >= std::min<std::uint64_t>(span.last(), kLastVersion) || span.width == 0) return false;
  for (const std::uint32_t half : {0U, 1U}) {
    const VersionSpan part{static_cast<std::uint8_t>(span.width - 1), 2 * span.index + half};
    if (part.last() > last && part.first() <= kLastVersion) add_node({.span = part});
  }
  return true;
}

std::span<const Description::Mark> Comparison::list_own(const Ledger& ledger,
                                                        const Ledger::Contribution& contribution,
                                                        const VersionSpan& span,
                                                        std::uint32_t& last) noexcept {
  return own_.first(list_marks(ledger.records(), contribution, span, last, own_, visited_));
}

bool Comparison::write_next(RequestedContribution& requested) noexcept {
  requested.target = robot_;
  if (wanted_count_ != 0) {
    requested.type = RequestType::kVersions;
    const auto all = wanted_.first(wanted_count_);
    heap_sort(all);
    const auto one_each = std::unique(all.begin(), all.end());
    wanted_count_ = static_cast<std::size_t>(one_each - all.begin());
    const std::size_t count = std::min(wanted_count_, RequestedContribution::kMostVersions);
    std::copy_n(all.begin(), count, requested.version.begin());
    std::copy(all.begin() + static_cast<std::ptrdiff_t>(count),
              all.begin() + static_cast<std::ptrdiff_t>(wanted_count_), all.begin());
    wanted_count_ -= count;
    requested.count = static_cast<std::uint8_t>(count);
    return true;
  }
  if (gap_count_ != 0) {
    requested.type = RequestType::kGaps;
    requested.count = static_cast<std::uint8_t>(gap_count_);
    const auto gaps = gaps_.first(gap_count_);
    heap_sort(gaps, [](const auto& x, const auto& y) { return x.first < y.first; });
    std::copy(gaps.begin(), gaps.end(), requested.gap.begin());
    gap_count_ = 0;
    return true;
  }
  requested.type = RequestType::kDescribe;
  requested.count = 0;
  for (Node& node : nodes_.first(node_count_)) {
    const bool is_full = requested.count == RequestedContribution::kMostSpans;
    if (node.state != State::kToAsk || is_full) continue;
    if (requested.count != 0 && node.span.width != requested.width) continue;
    requested.width = node.span.width;
    requested.span[requested.count++] = node.span.index;
    node.state = State::kAsked;
  }
  const auto spans = std::span(requested.span).first(requested.count);
  heap_sort(spans);
  return requested.count != 0;
}

std::size_t Comparison::describe(const Ledger& ledger, const Ledger::Contribution& contribution,
                                 VersionSpan span, Description& description) noexcept {
  std::size_t visited = 0;
  description.span = span;
  const std::uint8_t bucket = contribution.index.width();
  description.is_list = span.width <= bucket || span.width == 0;
  if (description.is_list) {
    description.part_width = 0;
    description.last = kLastVersion;
    description.count = static_cast<std::uint8_t>(list_marks(
        ledger.records(), contribution, span, description.last, description.record, visited));
    // Where a list is whole, its sum shows whether equal marks are of equal contents.
    if (description.last >= range_of(span).last) return visited;
    description.is_list = false;
  }
  // Lists of some 64 records each, or down to a bucket.
  const auto lists = static_cast<unsigned>(std::bit_width(visited / 64));
  const auto wider = static_cast<unsigned>(span.width > bucket ? span.width - bucket : span.width);
  const unsigned bits =
      std::min({kPartBits, wider, span.width > bucket ? wider : std::max(1U, lists)});
  description.part_width = static_cast<std::uint8_t>(span.width - bits);
  description.count = static_cast<std::uint8_t>(1U << bits);
  return visited + sum_parts(ledger, contribution, description, description.sum);
}

}  // namespace tessera
