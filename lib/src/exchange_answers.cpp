// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What others ask for, and what of it is still to be said.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

bool Exchange::hear_request(ByteReader& body, std::int64_t now_us) noexcept {
  RequestedContribution requested;
  for (ByteReader all = body; all.remaining() != 0;) {
    if (!read_requested(all, requested)) return false;
  }
  while (body.remaining() != 0 && read_requested(body, requested))
    hear_requested(requested, now_us);
  return true;
}

void Exchange::hear_requested(const RequestedContribution& requested,
                              std::int64_t now_us) noexcept {
  Contribution* const contribution = find(requested.id);
  if (contribution == nullptr || !contribution->open) return;
  const auto delay = [&] {
    return contribution->own ? random_us(config_.answer_us / 8 + 1)
                             : config_.answer_us / 4 + random_us(config_.answer_us);
  };
  if (requested.frame_revision < contribution->frame_revision)
    contribution->frame_due_us = std::min(contribution->frame_due_us, now_us + delay());
  if (requested.all) {
    if (requested.digest != contribution->digest) answer_with_all(*contribution, now_us + delay());
    return;
  }
  const auto gaps = std::span(requested.gap).first(requested.gaps);
  for (const VersionRange& gap : gaps) {
    for (const VersionRange& known : contribution->coverage.ranges_from(gap.first)) {
      const VersionRange both{std::max(gap.first, known.first), std::min(gap.last, known.last)};
      if (both.first > both.last) break;
      if (!add_answer({number_of(*contribution), both, now_us + delay(), false})) return;
    }
  }
  // Who lacks the same waits for the answer to this.
  if (contribution->request_due_us == kNever || gaps.empty()) return;
  const bool same = std::any_of(gaps.begin(), gaps.end(), [&](const VersionRange& gap) {
    return !contribution->coverage.contains(gap) && gap.first <= contribution->latest;
  });
  if (!same) return;
  ++counted_.requests_saved;
  contribution->request_due_us =
      std::max(contribution->request_due_us,
               now_us + contribution->request_pause_us + random_us(contribution->request_pause_us));
}

void Exchange::answer_with_all(const Contribution& contribution, std::int64_t due_us) noexcept {
  // Also what is held and not covered, or beyond what its origin was last heard to have.
  static_cast<void>(add_answer({number_of(contribution), {1, kLastVersion}, due_us, true}));
}

/// False iff there is no place: it will be asked for again.
bool Exchange::add_answer(const Answer& wanted) noexcept {
  for (Answer& answer : answers_.first(waiting_answers_)) {
    const bool apart =
        wanted.range.last < answer.range.first || answer.range.last < wanted.range.first;
    if (answer.contribution != wanted.contribution || apart) continue;
    answer.range.first = std::min(answer.range.first, wanted.range.first);
    answer.range.last = std::max(answer.range.last, wanted.range.last);
    answer.all = answer.all || wanted.all;
    return true;
  }
  if (waiting_answers_ == answers_.size()) {
    ++counted_.refused_answers;
    return false;
  }
  answers_[waiting_answers_++] = wanted;
  return true;
}

/// What somebody else has said needs no saying; all: one who has the same as this robot said all.
void Exchange::drop_answers(std::uint32_t contribution, VersionRange heard, bool all) noexcept {
  for (std::size_t i = 0; i < waiting_answers_;) {
    VersionRange& range = answers_[i].range;
    const bool apart = heard.last < range.first || range.last < heard.first;
    if (answers_[i].contribution == contribution && !apart && (all || !answers_[i].all)) {
      const VersionRange before = range;
      if (heard.first <= range.first) {
        range.first = heard.last == ~std::uint32_t{0} ? heard.last : heard.last + 1;
        if (heard.last >= range.last) range = {};
      } else if (heard.last >= range.last) {
        range.last = heard.first - 1;
      }
      counted_.answers_saved += range == before ? 0U : 1U;
    }
    if (range.first > range.last) {
      answers_[i] = answers_[--waiting_answers_];
    } else {
      ++i;
    }
  }
}

}  // namespace tessera
