// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What arrives, by kind, and which part of the exchange it is for.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

void Exchange::receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
  Heard heard;
  const Instant now = Instant::at_us(now_us);
  static_cast<void>(is_listening(now));
  heard.describing = repair_.comparison().describing();
  if (!gate_.accept(datagram, now, heard, counted_)) return;
  if (!hear(heard)) ++counted_.refused_body;
  judge_conflicts();
}

/// False iff the body is none of its kind.
bool Exchange::hear(Heard& heard) noexcept {
  switch (heard.header.kind) {
    case DatagramKind::kAnnounce:
      return hear_announcement(heard);
    case DatagramKind::kRequest:
      return hear_request(heard);
    case DatagramKind::kChunk:
      return hear_chunk(heard);
    case DatagramKind::kFrame:
      return hear_frame(heard);
    case DatagramKind::kStatement:
      return hear_statement(heard);
    case DatagramKind::kDescription:
      return hear_description(heard);
    case DatagramKind::kConflict:
      return hear_conflict(heard);
    case DatagramKind::kLeave:
      if (!heard.body.empty()) return false;
      heard.peer->left = heard.peer->left || heard.is_last;
      return true;
  }
  return false;
}

Duration Exchange::answer_delay(const Ledger::Contribution& contribution) noexcept {
  if (contribution.own) return repair_.random({answer_.us / 8 + 1});
  return answer_ / 4 + repair_.random(answer_);
}

// --- Requests ------------------------------------------------------------------------------------

bool Exchange::hear_request(const Heard& heard) noexcept {
  for (ByteReader all(heard.body); all.remaining() != 0;) {
    if (!read_requested(all, *requested_)) return false;
  }
  for (ByteReader body(heard.body); body.remaining() != 0 && read_requested(body, *requested_);)
    hear_requested(heard);
  return true;
}

void Exchange::hear_requested(const Heard& heard) noexcept {
  const Ledger::Contribution* const contribution = ledger_.find(requested_->id);
  if (contribution == nullptr || !contribution->open) return;
  if (requested_->frame_revision < contribution->frame_revision)
    sender_.owe_frame(ledger_, *contribution, heard.now + answer_delay(*contribution));
  const bool newer =
      contribution->own
          ? !requested_->stated || requested_->latest < contribution->latest
          : contribution->stated &&
                (!requested_->stated || requested_->latest < contribution->statement.latest);
  if (newer) sender_.owe_statement(ledger_, *contribution, heard.now + answer_delay(*contribution));
  if (!sender_.answers().may_ask(*heard.peer, ledger_, heard.now)) {
    counted_.refused_answers += requested_->count != 0 ? 1U : 0U;
    return;
  }
  if (requested_->type == RequestType::kGaps) {
    hear_gaps(heard, *contribution);
  } else if (requested_->target == robot_) {
    hear_targeted(heard, *contribution);
  }
}

void Exchange::hear_gaps(const Heard& heard, const Ledger::Contribution& contribution) noexcept {
  const auto gaps = std::span(requested_->gap).first(requested_->count);
  for (const VersionRange& gap : gaps) {
    for (const VersionRange& known : contribution.coverage.ranges_from(gap.first)) {
      const VersionRange both{std::max(gap.first, known.first), std::min(gap.last, known.last)};
      if (both.first > both.last) break;
      const Answers::Range range{
          ledger_.number_of(contribution),        contribution.generation, both,
          heard.now + answer_delay(contribution), heard.header.sender,     contribution.records};
      if (!sender_.answers().add(range, counted_)) return;
    }
  }
  if (contribution.own) return;
  // Who asks for much more than this robot lacks will have it later.
  std::uint64_t asked = 0;
  std::uint64_t lacking = 0;
  for (const VersionRange& gap : gaps) {
    if (gap.first > contribution.latest) break;
    const VersionRange known{gap.first, std::min(gap.last, contribution.latest)};
    asked += known.last - known.first + 1;
    lacking += contribution.coverage.lacking(known);
  }
  if (2 * lacking > asked) repair_.note_asked(ledger_, contribution, heard.now, counted_);
}

void Exchange::hear_targeted(const Heard& heard,
                             const Ledger::Contribution& contribution) noexcept {
  const std::uint32_t number = ledger_.number_of(contribution);
  const std::uint32_t asker = heard.header.sender;
  auto& picks = sender_.answers().picks();
  auto& spans = sender_.answers().spans();
  const bool of_versions = requested_->type == RequestType::kVersions;
  const std::size_t room = of_versions ? picks.room_for(asker) : spans.room_for(asker);
  for (std::size_t i = 0; i < requested_->count; ++i) {
    const bool added =
        i < room &&
        (of_versions ? picks.push({number, contribution.generation, requested_->version[i], asker})
                     : spans.push({number, contribution.generation, asker,
                                   VersionSpan{requested_->width, requested_->span[i]}}));
    if (!added) {
      ++counted_.refused_answers;
      return;
    }
  }
}

// --- What comes of contributions -----------------------------------------------------------------

bool Exchange::hear_chunk(const Heard& heard) noexcept {
  ByteReader body(heard.body);
  if (!read_chunk_header(body, heard.header.session, chunk_)) return false;
  const std::span<const std::byte> rest = heard.body.last(body.remaining());
  if (gate_.is_excluded(chunk_.id.robot)) return true;
  // Only an origin sends without proofs.
  if (!chunk_.relayed && chunk_.id.robot != heard.header.sender) return false;
  if (ledger_.is_of_this_process(chunk_.id)) {
    const Ledger::Contribution* const own = ledger_.find(chunk_.id);
    if (own == nullptr) {
      // Where robots sign, nothing is known by a name that anybody may say.
      counted_.impostors += gate_.signatures().on() ? 0U : 1U;
    } else if (const auto held = ledger_.check_own_chunk(*own, chunk_, rest, is_awaited(*own));
               held) {
      drop_answers(heard, *own, *held);
    } else {
      ++counted_.impostors;
    }
    return true;
  }
  Ledger::Contribution* const contribution = ledger_.note_name(chunk_.id, heard.now, counted_);
  if (contribution == nullptr || contribution->own) return true;
  if (!contribution->open) {
    ++counted_.records_early;
    repair_.note_lack(ledger_, *contribution, heard.now);
    return true;
  }
  const Ledger::Taken taken =
      ledger_.take_chunk(*contribution, chunk_, rest, is_awaited(*contribution), counted_);
  if (taken.forged) ++counted_.refused_signature;
  if (taken.forged || !taken.well_formed) {
    repair_.note_taken(ledger_, *contribution, taken, false, heard.header.sender, heard.now);
    return taken.well_formed;
  }
  const bool fills = chunk_.range.first <= contribution->latest;
  if (!chunk_.relayed) {
    contribution->origin_at = heard.now;
    ledger_.take_chunk_statement(*contribution, chunk_.statement, heard.is_last, counted_);
  }
  drop_answers(heard, *contribution, taken.held);
  repair_.note_taken(ledger_, *contribution, taken, fills, heard.header.sender, heard.now);
  return true;
}

/// True if somebody waits for versions of the chunk.
bool Exchange::is_awaited(const Ledger::Contribution& contribution) noexcept {
  return sender_.answers().touches(ledger_.number_of(contribution), chunk_.range);
}

/// What another robot sent needs no sending, if it had all of it.
void Exchange::drop_answers(const Heard& heard, const Ledger::Contribution& contribution,
                            std::uint32_t held) noexcept {
  if (!heard.is_new || chunk_.partial || !is_awaited(contribution) ||
      !ledger_.is_all_of(contribution, chunk_.range, held))
    return;
  counted_.answers_saved += sender_.answers().drop(ledger_.number_of(contribution), chunk_.range);
}

bool Exchange::hear_frame(const Heard& heard) noexcept {
  FrameBody frame;
  ByteReader body(heard.body);
  if (!read_frame(body, frame)) return false;
  const std::span<const std::byte> signature = body.bytes(body.remaining());
  if (signature.size() != (gate_.signatures().on() ? kSignatureBytes : 0)) return false;
  if (ledger_.is_of_this_process(frame.id)) {
    const bool is_known = ledger_.find(frame.id) != nullptr || gate_.signatures().on();
    counted_.impostors += is_known ? 0U : 1U;
    return true;
  }
  if (gate_.is_excluded(frame.id.robot)) return true;
  const Ledger::Contribution* const before = ledger_.find(frame.id);
  if (before != nullptr && heard.is_new && frame.revision == before->frame_revision &&
      frame.T_global_map == before->T_global_map)
    sender_.drop_frame(ledger_, *before);
  const bool is_last = heard.is_last && frame.id.robot == heard.header.sender;
  if (!ledger_.take_frame(frame, signature, is_last, heard.now, counted_)) return false;
  Ledger::Contribution* const contribution = ledger_.find(frame.id);
  if (contribution != nullptr) repair_.note_lack(ledger_, *contribution, heard.now);
  return true;
}

/// Without signatures an origin is believed about itself, and others about it while it is silent
/// for some announcements.
bool Exchange::hear_statement(const Heard& heard) noexcept {
  Statement statement;
  ByteReader body(heard.body);
  if (!read_statement(body, statement)) return false;
  std::span<const std::byte> proof;
  if (gate_.signatures().on()) proof = read_proof(body);
  if (!body.ok() || body.remaining() != 0) return false;
  if (gate_.is_excluded(statement.id.robot)) return true;
  const bool of_origin =
      heard.header.sender == statement.id.robot && heard.header.session == statement.session;
  const Ledger::Contribution* const known = ledger_.find(statement.id);
  if (!gate_.signatures().on() && !of_origin && known != nullptr && known->stated &&
      heard.now - known->origin_at <= kSilences * announce_)
    return true;
  if (!ledger_.take_statement(statement, proof, of_origin && heard.is_last, heard.now, counted_)) {
    ++counted_.refused_signature;
    return true;
  }
  Ledger::Contribution* const contribution = ledger_.find(statement.id);
  if (contribution == nullptr || contribution->own) return true;
  if (heard.is_new && contribution->stated && !contribution->statement.is_newer_than(statement))
    sender_.drop_statement(ledger_, *contribution);
  repair_.note_lack(ledger_, *contribution, heard.now);
  return true;
}

bool Exchange::hear_description(const Heard& heard) noexcept {
  DescriptionHeader header;
  ByteReader all(heard.body);
  if (!read_description_header(all, header)) return false;
  ByteReader body = all;
  while (all.remaining() != 0) {
    if (!read_description(all, *description_)) return false;
  }
  Comparison& comparison = repair_.comparison();
  const Ledger::Contribution* const contribution = ledger_.find(header.id);
  if (header.target != robot_ || contribution == nullptr ||
      heard.header.sender != comparison.robot() ||
      !comparison.is_of(ledger_.number_of(*contribution), contribution->generation))
    return true;
  std::size_t room = sender_.answers().picks().room_for(heard.header.sender);
  const auto send = [&](std::uint32_t version) {
    if (!sender_.answers().may_ask(*heard.peer, ledger_, heard.now)) return;
    const Answers::Pick pick{ledger_.number_of(*contribution), contribution->generation, version,
                             heard.header.sender};
    const bool added = room != 0 && sender_.answers().picks().push(pick);
    room -= added ? 1U : 0U;
    counted_.refused_answers += added ? 0U : 1U;
  };
  const auto send_range = [&](const VersionRange& range) {
    // Its parts would be sent no sooner.
    if (!sender_.answers().may_ask(*heard.peer, ledger_, heard.now)) return true;
    return sender_.answers().add({ledger_.number_of(*contribution), contribution->generation, range,
                                  heard.now, heard.header.sender, contribution->records},
                                 counted_);
  };
  while (body.remaining() != 0 && read_description(body, *description_))
    comparison.hear(ledger_, *contribution, *description_, heard.now, send, send_range);
  return true;
}

}  // namespace tessera
