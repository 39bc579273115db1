// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/control_writer.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// Frames and statements are few and nothing goes without them: each is sent unasked with one
/// announcement of so many.
constexpr std::uint64_t kAnnouncementsOfFrame = 8;
/// Between two times that the same is sent because it is asked for.
constexpr Duration kBetweenRepeats{500'000};
constexpr Duration kBetweenSeldom{8'000'000};

}  // namespace

Result<ControlWriter> ControlWriter::make(Arena& arena, const ExchangeConfig& config) noexcept {
  ControlWriter made;
  made.announce_ = {config.announce_us};
  made.announce_soon_time_ = {config.announce_soon_us};
  made.frame_pause_ = {config.frame_us};
  made.dues_ = arena.take<Due>(config.contributions);
  if (made.dues_.empty()) return Status::kResourceExhausted;
  return made;
}

bool ControlWriter::write(Outgoing& out, ByteWriter& to) noexcept {
  return write_due_frame(out, to) || write_due_statement(out, to) || write_due_conflict(out, to) ||
         write_announcement(out, to);
}

void ControlWriter::begin_own(const Ledger& ledger) noexcept {
  announce_due_ = Instant::long_ago();
  if (ledger.publishing() == nullptr) return;
  owe_frame(ledger, *ledger.publishing(), Instant::long_ago());
  owe_statement(ledger, *ledger.publishing(), Instant::long_ago());
}

ControlWriter::Due& ControlWriter::due_of(const Ledger& ledger,
                                          const Ledger::Contribution& contribution) noexcept {
  Due& due = dues_[ledger.number_of(contribution)];
  if (due.generation != contribution.generation) {
    due = {};
    due.generation = contribution.generation;
  }
  return due;
}

/// Who makes it due sooner is charged for it, and not who asks while it is.
void ControlWriter::owe(Owed& owed, Instant at, Duration pause,
                        const std::optional<Asker>& asker) noexcept {
  const bool seldom = asker && !asker->may_ask;
  const Instant due = std::max(at, owed.sent + (seldom ? kBetweenSeldom : pause));
  if (due >= owed.due) return;
  owed.due = due;
  owed.asker.reset();
  if (asker && asker->may_ask) owed.asker = asker->robot;
}

void ControlWriter::settle(Owed& owed, Outgoing& out) noexcept {
  owed.due = Instant::never();
  owed.sent = out.now;
  out.for_asker = owed.asker.has_value();
  out.asker = owed.asker.value_or(0);
}

void ControlWriter::owe_frame(const Ledger& ledger, const Ledger::Contribution& contribution,
                              Instant at, const std::optional<Asker>& asker) noexcept {
  owe(due_of(ledger, contribution).frame, at, std::max(kBetweenRepeats, frame_pause_), asker);
}

void ControlWriter::owe_statement(const Ledger& ledger, const Ledger::Contribution& contribution,
                                  Instant at, const std::optional<Asker>& asker) noexcept {
  owe(due_of(ledger, contribution).statement, at, kBetweenRepeats, asker);
}

void ControlWriter::note_extent(const Ledger& ledger, bool at_end) noexcept {
  const Ledger::Contribution* const own = ledger.publishing();
  if (own == nullptr) return;
  const BlockExtent known = own->signed_extent;
  const BlockExtent extent = ledger.table().extent_of(*own);
  // Frames go out with announcements as well.
  constexpr std::int32_t kWell = 4;
  const BlockExtent wide{{known.low.x - kWell, known.low.y - kWell, known.low.z - kWell},
                         {known.high.x + kWell, known.high.y + kWell, known.high.z + kWell}};
  const bool is_known = known.any() && (at_end ? known : wide).contains(extent);
  if (!is_known && extent.any()) owe_frame(ledger, *own, Instant::long_ago());
}

void ControlWriter::drop_frame(const Ledger& ledger,
                               const Ledger::Contribution& contribution) noexcept {
  due_of(ledger, contribution).frame.due = Instant::never();
}

void ControlWriter::drop_statement(const Ledger& ledger,
                                   const Ledger::Contribution& contribution) noexcept {
  due_of(ledger, contribution).statement.due = Instant::never();
}

/// Unasked, each in its turn: many at once would keep everything else waiting.
void ControlWriter::owe_own(const Outgoing& out) noexcept {
  std::uint64_t turn = out.counted.announcements;
  for (const Ledger::Contribution& contribution : out.ledger.places()) {
    if (!contribution.used || !contribution.own) continue;
    if (turn++ % kAnnouncementsOfFrame != 0) continue;
    owe_frame(out.ledger, contribution, out.now);
    owe_statement(out.ledger, contribution, out.now);
  }
}

/// In turn, as many as fit. False: not all.
bool ControlWriter::announce(const Outgoing& out, ByteWriter& to, bool own,
                             std::uint32_t& next) noexcept {
  const std::span<const Ledger::Contribution> places = out.ledger.places();
  for (std::size_t i = 0; i < places.size(); ++i, ++next) {
    if (next >= places.size()) next = 0;
    const Ledger::Contribution& one = places[next];
    if (!one.used || !one.open || one.own != own || (one.is_far() && !one.complete())) continue;
    const bool is_disputed = !out.ledger.conflicts().has_room_for(one.id.robot, one.id.epoch);
    if (!write_announced(to, {.id = one.id,
                              .latest = own ? one.latest : one.statement.latest,
                              .frame_revision = one.frame_revision,
                              .stated = own || one.stated,
                              .complete = one.complete(),
                              .origin = own,
                              .disputed = is_disputed,
                              .digest = one.held.folded()}))
      return false;
  }
  return true;
}

/// Their counters were lost: only they can say so, and others have forgotten what they signed.
void ControlWriter::announce_floors(const Outgoing& out, ByteWriter& to) const noexcept {
  if (!out.gate.signatures().on()) return;
  for (const Peer& peer : out.gate.peers().all()) {
    const std::uint32_t floor = out.ledger.floors().of(peer.robot);
    const bool is_here = out.now - peer.heard <= 2 * announce_;
    if (peer.floor >= floor || !is_here) continue;
    if (!write_announced(to, {.id = {peer.robot, floor, 0}})) return;
  }
}

/// This robot's first, and where they leave no room, the others first every other time.
bool ControlWriter::write_announcement(Outgoing& out, ByteWriter& to) noexcept {
  if (!announces(out.now)) return false;
  out.kind = DatagramKind::kAnnounce;
  announce_due_ =
      out.now + Duration{announce_.us - announce_.us / 10} + out.repair.random(announce_ / 5);
  AnnouncementHeader header{.details = out.gate.details(),
                            .floor = out.ledger.floors().own(),
                            .data_sequence = out.data_sequence};
  out.gate.write_challenges(header, out.now,
                            static_cast<std::uint64_t>(out.repair.random({INT64_MAX}).us));
  write_announcement_header(to, header);
  owe_own(out);
  others_first_ = !others_first_ && own_only_;
  if (others_first_) static_cast<void>(announce(out, to, false, announced_next_));
  own_only_ = !announce(out, to, true, announced_own_);
  announce_floors(out, to);
  if (!others_first_) {
    const std::size_t before = to.size();
    const bool all_fit = announce(out, to, false, announced_next_);
    own_only_ = own_only_ || (!all_fit && to.size() == before);
  }
  ++out.counted.announcements;
  return true;
}

/// Frames that are due and go well together: of one robot, all signed by this one or none, and for
/// the same asker, who pays for what it made due and for nothing else. What does not fit is next.
bool ControlWriter::write_due_frame(Outgoing& out, ByteWriter& to) noexcept {
  const Signatures& signatures = out.gate.signatures();
  FrameWriter writer(to);
  FramesHeader header;
  std::optional<std::uint32_t> asker;
  bool any = false;
  for (Ledger::Contribution& contribution : out.ledger.places()) {
    if (!contribution.used || !contribution.open) continue;
    Owed& owed = due_of(out.ledger, contribution).frame;
    if (out.now < owed.due) continue;
    const bool relayed = !contribution.own && !contribution.moved;
    if (!any) {
      header = {.robot = contribution.id.robot, .relayed = relayed};
      asker = owed.asker;
      write_frames_header(to, header);
      out.tree.clear();
    } else if (contribution.id.robot != header.robot || relayed != header.relayed ||
               owed.asker != asker) {
      continue;
    }
    const FrameBody frame = out.ledger.frame_of(contribution);
    if (!writer.write(frame,
                      relayed ? contribution.frame_proof.bytes() : std::span<const std::byte>{})) {
      TESSERA_ASSERT(any);  // one always fits
      break;
    }
    if (signatures.on() && !relayed) out.tree.add(leaf_of(signatures, frame));
    if (contribution.own) contribution.signed_extent = frame.extent;
    settle(owed, out);
    ++out.counted.frames;
    any = true;
  }
  if (!any) return false;
  out.kind = DatagramKind::kFrame;
  out.needs_signature = signatures.on() && !header.relayed;
  if (out.needs_signature) out.sign_root(TreeOf::frames(header.robot));
  return true;
}

/// The origin signs a tree of the statement alone; a relay sends the proof that it got.
bool ControlWriter::write_due_statement(Outgoing& out, ByteWriter& to) noexcept {
  for (const Ledger::Contribution& contribution : out.ledger.places()) {
    if (!contribution.used || !(contribution.own || contribution.stated)) continue;
    Owed& owed = due_of(out.ledger, contribution).statement;
    if (out.now < owed.due) continue;
    settle(owed, out);
    ++out.counted.statements;
    out.kind = DatagramKind::kStatement;
    out.needs_signature = false;  // it is in the proof
    if (!contribution.own) {
      const bool written = write_statement(to, contribution.statement);
      to.bytes(contribution.proof.bytes());
      return written && to.ok();
    }
    const Statement statement = out.ledger.statement_of(contribution, {1, 1});
    if (!write_statement(to, statement)) return false;
    const Signatures& signatures = out.gate.signatures();
    if (!signatures.on()) return true;
    out.tree.clear();
    out.tree.add(leaf_of(signatures, statement));
    out.sign_root(contribution.id);
    std::array<std::byte, kMostProofBytes> proof{};
    to.bytes(std::span(proof).first(write_proof(out.tree, 0, out.signature, proof)));
    return to.ok();
  }
  return false;
}

/// It has both signatures in its proofs.
bool ControlWriter::write_due_conflict(Outgoing& out, ByteWriter& to) noexcept {
  if (!out.ledger.conflicts().write_due(to, out.now)) return false;
  out.kind = DatagramKind::kConflict;
  out.needs_signature = false;
  return true;
}

}  // namespace tessera
