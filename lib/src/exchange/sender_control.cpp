// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Announcements, frames, statements and descriptions.
#include <algorithm>

#include "tessera/exchange/internal/sender.hpp"

namespace tessera {

namespace {

/// Frames and statements are few and nothing goes without them: they are sent unasked with one
/// announcement of so many.
constexpr std::uint64_t kAnnouncementsOfFrame = 8;

}  // namespace

/// As many contributions as fit, this robot's first, the others in turn.
bool Sender::write_announcement(Making& make, ByteWriter& to) noexcept {
  if (make.now < announce_due_) return false;
  make.kind = DatagramKind::kAnnounce;
  announce_due_ =
      make.now + Duration{announce_.us - announce_.us / 10} + make.repair.random(announce_ / 5);
  AnnouncementHeader header{.details = make.gate.details(),
                            .floor = make.ledger.own_floor(),
                            .data_sequence = data_sequence_};
  make.gate.write_challenges(header, make.now,
                             static_cast<std::uint64_t>(make.repair.random({INT64_MAX}).us));
  write_announcement_header(to, header);
  const auto announce = [&](const Ledger::Contribution& contribution) {
    return write_announced(
        to, {.id = contribution.id,
             .latest = contribution.own ? contribution.latest : contribution.statement.latest,
             .frame_revision = contribution.frame_revision,
             .stated = contribution.own || contribution.stated,
             .complete = contribution.complete(),
             .origin = contribution.own,
             .disputed = !make.ledger.conflicts().has_room_for(contribution.id.robot,
                                                               contribution.id.epoch),
             .digest = contribution.held.folded()});
  };
  const bool with_frames = make.counted.announcements % kAnnouncementsOfFrame == 0;
  const std::span<Ledger::Contribution> places = make.ledger.places();
  for (const Ledger::Contribution& contribution : places) {
    if (!contribution.used || !contribution.own) continue;
    if (with_frames) {
      owe_frame(make.ledger, contribution, make.now);
      owe_statement(make.ledger, contribution, make.now);
    }
    if (!announce(contribution)) break;
  }
  for (const Peer& peer : make.gate.peers().all()) {
    // Its counter was lost: only it can say so, and others have forgotten what it signed.
    const std::uint32_t floor = make.ledger.floor_of(peer.robot);
    const bool is_here = make.now - peer.heard <= 2 * announce_;
    if (!make.gate.signatures().on() || peer.floor >= floor || !is_here) continue;
    if (!write_announced(to, {.id = {peer.robot, floor, 0}})) break;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (announced_next_ >= places.size()) announced_next_ = 0;
    const Ledger::Contribution& contribution = places[announced_next_];
    if (contribution.used && contribution.open && !contribution.own && !announce(contribution))
      break;
    ++announced_next_;
  }
  ++make.counted.announcements;
  return true;
}

bool Sender::write_due_frame(Making& make, ByteWriter& to) noexcept {
  for (const Ledger::Contribution& contribution : make.ledger.places()) {
    if (!contribution.used || !contribution.open) continue;
    Due& due = due_of(make.ledger, contribution);
    if (make.now < due.frame) continue;
    due.frame = Instant::never();
    due.frame_sent = make.now;
    ++make.counted.frames;
    make.kind = DatagramKind::kFrame;
    const FrameBody frame{.id = contribution.id,
                          .revision = contribution.frame_revision,
                          .T_global_map = contribution.T_global_map};
    signature_ = contribution.frame_signature;
    const Signatures& signatures = make.gate.signatures();
    if (signatures.on() && contribution.own)
      signatures.sign(signatures.context, frame_message(make.gate.configuration(), frame),
                      signature_);
    return write_frame(to, frame);
  }
  return false;
}

/// The origin signs a tree of the statement alone; a relay sends the proof that it got.
bool Sender::write_due_statement(Making& make, ByteWriter& to) noexcept {
  for (const Ledger::Contribution& contribution : make.ledger.places()) {
    if (!contribution.used || !(contribution.own || contribution.stated)) continue;
    Due& due = due_of(make.ledger, contribution);
    if (make.now < due.statement) continue;
    due.statement = Instant::never();
    due.statement_sent = make.now;
    ++make.counted.statements;
    make.kind = DatagramKind::kStatement;
    needs_signature_ = false;  // it is in the proof
    if (!contribution.own) {
      const bool written = write_statement(to, contribution.statement);
      to.bytes(std::span(contribution.proof).first(contribution.proof_bytes));
      return written && to.ok();
    }
    const Statement statement = make.ledger.statement_of(contribution, {1, 1});
    if (!write_statement(to, statement)) return false;
    const Signatures& signatures = make.gate.signatures();
    if (!signatures.on()) return true;
    tree_->clear();
    tree_->add(leaf_of(signatures, statement));
    sign_root(make, contribution.id);
    std::array<std::byte, kMostProofBytes> proof{};
    to.bytes(std::span(proof).first(write_proof(*tree_, 0, signature_, proof)));
    return to.ok();
  }
  return false;
}

/// It has both signatures in its proofs.
bool Sender::write_due_conflict(Making& make, ByteWriter& to) noexcept {
  if (!make.ledger.conflicts().write_due(to, make.now)) return false;
  make.kind = DatagramKind::kConflict;
  needs_signature_ = false;
  return true;
}

void Sender::sign_root(Making& make, const ContributionId& id) noexcept {
  const Signatures& signatures = make.gate.signatures();
  const auto message =
      root_message(make.gate.configuration(), id, tree_->count(), tree_->root(signatures));
  signatures.sign(signatures.context, message, signature_);
}

/// Of one contribution and for one robot, as many as fit.
bool Sender::write_descriptions(Making& make, ByteWriter& to) noexcept {
  ByteWriter trial = to;
  if (needs_signature_) trial.keep_free(kSignatureBytes);
  auto& spans = answers_.spans();
  bool any = false;
  Answers::Span first{};
  while (spans.count != 0) {
    const Answers::Span next = spans.front();
    const Ledger::Contribution& contribution = make.ledger.places()[next.contribution];
    if (!contribution.used || contribution.generation != next.generation ||
        !may_answer(make, next.asker)) {
      spans.pop();
      continue;
    }
    if (!any) {
      first = next;
      write_description_header(trial, {contribution.id, next.asker});
    } else if (next.contribution != first.contribution || next.asker != first.asker) {
      break;
    }
    note_walk(make, next.asker,
              Comparison::describe(make.ledger, contribution, next.span, *description_));
    if (!write_description(trial, *description_)) break;
    any = true;
    spans.pop();
  }
  if (!any) return false;
  to = trial;
  make.kind = DatagramKind::kDescription;
  make.asker = first.asker;
  make.for_asker = true;
  ++make.counted.descriptions;
  return true;
}

}  // namespace tessera
