// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/message_taker.hpp"

#include <algorithm>

namespace tessera {

Result<MessageTaker> MessageTaker::make(Arena& arena, const ExchangeConfig& config) noexcept {
  MessageTaker made;
  made.robot_ = config.robot;
  made.answer_ = {config.answer_us};
  made.announce_ = {config.announce_us};
  made.announcements_ = AnnouncementTaker(config);
  made.requested_ = arena.take<RequestedContribution>(1).data();
  made.description_ = arena.take<Description>(1).data();
  made.chunk_ = arena.take<ChunkHeader>(1).data();
  made.frames_ = arena.take<HashTree>(1).data();
  if (made.requested_ == nullptr || made.description_ == nullptr || made.chunk_ == nullptr ||
      made.frames_ == nullptr)
    return Status::kResourceExhausted;
  return made;
}

/// False iff the body is none of its kind.
bool MessageTaker::hear_kind(const ExchangeParts& parts, const Heard& heard) noexcept {
  switch (heard.header.kind) {
    case DatagramKind::kAnnounce:
      return announcements_.hear(parts, heard);
    case DatagramKind::kRequest:
      return hear_request(parts, heard);
    case DatagramKind::kChunk:
      return hear_chunk(parts, heard);
    case DatagramKind::kFrame:
      return hear_frames(parts, heard);
    case DatagramKind::kStatement:
      return hear_statement(parts, heard);
    case DatagramKind::kDescription:
      return hear_description(parts, heard);
    case DatagramKind::kConflict:
      return AnnouncementTaker::hear_conflict(parts, heard);
    case DatagramKind::kPresence:
      return heard.body.empty();
    case DatagramKind::kLeave:
      if (!heard.body.empty()) return false;
      heard.peer->left = heard.peer->left || heard.is_last;
      return true;
  }
  return false;
}

Duration MessageTaker::answer_delay(const ExchangeParts& parts, bool own) const noexcept {
  if (own) return parts.repair.random({answer_.us / 8 + 1});
  return answer_ / 4 + parts.repair.random(answer_);
}

/// Frames that are asked for together go out together.
Instant MessageTaker::frames_at(const ExchangeParts& parts, Instant now, bool own) noexcept {
  std::optional<Instant>& at = frames_at_[own ? 1 : 0];
  if (!at) at = now + answer_delay(parts, own);
  return *at;
}

bool MessageTaker::hear_request(const ExchangeParts& parts, const Heard& heard) noexcept {
  for (ByteReader all(heard.body); all.remaining() != 0;) {
    if (!read_requested(all, *requested_)) return false;
  }
  frames_at_ = {};
  for (ByteReader body(heard.body); body.remaining() != 0 && read_requested(body, *requested_);)
    hear_requested(parts, heard);
  return true;
}

void MessageTaker::hear_requested(const ExchangeParts& parts, const Heard& heard) noexcept {
  const HeldContribution* const contribution = parts.ledger.find(requested_->id);
  if (contribution == nullptr || !contribution->open) return;
  // Who has used up what it is answered still learns what there is, at little cost.
  const ControlWriter::Asker asker{
      heard.header.sender, parts.sender.answers().may_ask(*heard.peer, parts.ledger, heard.now)};
  const auto at = [&] { return heard.now + answer_delay(parts, contribution->own); };
  ControlWriter& control = parts.sender.control();
  if (requested_->frame_revision < contribution->frame_revision)
    control.owe_frame(parts.ledger, *contribution, frames_at(parts, heard.now, contribution->own),
                      asker);
  const bool newer =
      contribution->own
          ? !requested_->stated || requested_->latest < contribution->latest
          : contribution->stated &&
                (!requested_->stated || requested_->latest < contribution->statement.latest);
  if (newer) control.owe_statement(parts.ledger, *contribution, at(), asker);
  if (!asker.may_ask) {
    parts.counted.refused_answers += requested_->count != 0 ? 1U : 0U;
    return;
  }
  if (requested_->type == RequestType::kGaps) {
    hear_gaps(parts, heard, *contribution);
  } else if (requested_->target == robot_) {
    hear_targeted(parts, heard, *contribution);
  }
}

void MessageTaker::hear_gaps(const ExchangeParts& parts, const Heard& heard,
                             const HeldContribution& contribution) noexcept {
  const auto gaps = std::span(requested_->gap).first(requested_->count);
  for (const VersionRange& gap : gaps) {
    for (const VersionRange& known : contribution.coverage.ranges_from(gap.first)) {
      const VersionRange both{std::max(gap.first, known.first), std::min(gap.last, known.last)};
      if (both.first > both.last) break;
      const Answers::Range range{parts.ledger.number_of(contribution),
                                 contribution.generation,
                                 both,
                                 heard.now + answer_delay(parts, contribution.own),
                                 heard.header.sender,
                                 contribution.records};
      if (!parts.sender.answers().add(range, parts.counted)) return;
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
  if (2 * lacking > asked)
    parts.repair.note_asked(parts.ledger, contribution, heard.now, parts.counted);
}

void MessageTaker::hear_targeted(const ExchangeParts& parts, const Heard& heard,
                                 const HeldContribution& contribution) noexcept {
  const std::uint32_t number = parts.ledger.number_of(contribution);
  const std::uint32_t asker = heard.header.sender;
  auto& picks = parts.sender.answers().picks();
  auto& spans = parts.sender.answers().spans();
  const bool of_versions = requested_->type == RequestType::kVersions;
  const std::size_t room = of_versions ? picks.room_for(asker) : spans.room_for(asker);
  for (std::size_t i = 0; i < requested_->count; ++i) {
    const bool added =
        i < room &&
        (of_versions ? picks.push({number, contribution.generation, requested_->version[i], asker})
                     : spans.push({number, contribution.generation, asker,
                                   VersionSpan{requested_->width, requested_->span[i]}}));
    if (!added) {
      ++parts.counted.refused_answers;
      return;
    }
  }
}

// --- What comes of contributions -----------------------------------------------------------------

bool MessageTaker::hear_statement(const ExchangeParts& parts, const Heard& heard) const noexcept {
  Statement statement;
  ByteReader body(heard.body);
  if (!read_statement(body, statement)) return false;
  std::span<const std::byte> proof;
  if (parts.gate.signatures().on()) proof = read_proof(body);
  if (!body.ok() || body.remaining() != 0) return false;
  if (parts.is_refused(statement.id, heard, announce_)) return true;
  const bool of_origin =
      heard.header.sender == statement.id.robot && heard.header.session == statement.session;
  const HeldContribution* const known = parts.ledger.find(statement.id);
  if (known != nullptr && known->stated && !of_origin &&
      parts.origin_speaks(*known, heard, announce_))
    return true;
  if (!of_origin && parts.far_origin_speaks(statement.id, heard, announce_)) return true;
  if (!parts.ledger.take_statement(statement, proof, of_origin && heard.is_last, heard.now,
                                   parts.counted)) {
    ++parts.counted.refused_signature;
    return true;
  }
  HeldContribution* const contribution = parts.ledger.find(statement.id);
  if (contribution == nullptr || contribution->own) return true;
  if (heard.is_new && contribution->stated && !contribution->statement.is_newer_than(statement))
    parts.sender.control().drop_statement(parts.ledger, *contribution);
  parts.repair.note_lack(parts.ledger, *contribution, heard.now);
  return true;
}

bool MessageTaker::hear_description(const ExchangeParts& parts, const Heard& heard) noexcept {
  DescriptionHeader header;
  ByteReader all(heard.body);
  if (!read_description_header(all, header)) return false;
  ByteReader body = all;
  while (all.remaining() != 0) {
    if (!read_description(all, *description_)) return false;
  }
  Comparison& comparison = parts.repair.comparison();
  const HeldContribution* const contribution = parts.ledger.find(header.id);
  if (header.target != robot_ || contribution == nullptr ||
      heard.header.sender != comparison.robot() ||
      !comparison.is_of(parts.ledger.number_of(*contribution), contribution->generation))
    return true;
  std::size_t room = parts.sender.answers().picks().room_for(heard.header.sender);
  const auto send = [&](std::uint32_t version) {
    if (!parts.sender.answers().may_ask(*heard.peer, parts.ledger, heard.now)) return;
    const Answers::Pick pick{parts.ledger.number_of(*contribution), contribution->generation,
                             version, heard.header.sender};
    const bool added = room != 0 && parts.sender.answers().picks().push(pick);
    room -= added ? 1U : 0U;
    parts.counted.refused_answers += added ? 0U : 1U;
  };
  const auto send_range = [&](const VersionRange& range) {
    // Its parts would be sent no sooner.
    if (!parts.sender.answers().may_ask(*heard.peer, parts.ledger, heard.now)) return true;
    return parts.sender.answers().add(
        {parts.ledger.number_of(*contribution), contribution->generation, range, heard.now,
         heard.header.sender, contribution->records},
        parts.counted);
  };
  while (body.remaining() != 0 && read_description(body, *description_))
    comparison.hear(parts.ledger, *contribution, *description_, heard.now, send, send_range);
  return true;
}

}  // namespace tessera
