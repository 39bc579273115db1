// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The budget, and what a datagram is.
#include "tessera/exchange/internal/sender.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// Between two times that the same is sent because it is asked for.
constexpr Duration kBetweenRepeats{500'000};

}  // namespace

Result<Sender> Sender::make(Arena& arena, const ExchangeConfig& config) noexcept {
  Sender sender;
  sender.robot_ = config.robot;
  sender.session_ = config.session;
  sender.mission_ = config.mission;
  sender.bytes_per_s_ = config.bytes_per_s;
  sender.burst_bytes_ = config.burst_bytes;
  sender.announce_ = {config.announce_us};
  sender.announce_soon_time_ = {config.announce_soon_us};
  sender.frame_pause_ = {config.frame_us};
  Result<Answers> answers = Answers::make(arena, config);
  sender.dues_ = arena.take<Due>(config.contributions);
  sender.fresh_ = arena.take<Fresh>(config.fresh);
  sender.batches_ = arena.take<Batch>(kBatches);
  sender.tree_ = arena.take<HashTree>(1).data();
  sender.description_ = arena.take<Description>(1).data();
  if (!answers.ok() || sender.dues_.empty() || sender.fresh_.empty() || sender.batches_.empty() ||
      sender.tree_ == nullptr || sender.description_ == nullptr)
    return Status::kResourceExhausted;
  sender.answers_ = *answers;
  return sender;
}

Sender::Due& Sender::due_of(const Ledger& ledger,
                            const Ledger::Contribution& contribution) noexcept {
  Due& due = dues_[ledger.number_of(contribution)];
  if (due.generation != contribution.generation) {
    due = {};
    due.generation = contribution.generation;
  }
  return due;
}

void Sender::owe_frame(const Ledger& ledger, const Ledger::Contribution& contribution,
                       Instant at) noexcept {
  Due& due = due_of(ledger, contribution);
  due.frame =
      std::min(due.frame, std::max(at, due.frame_sent + std::max(kBetweenRepeats, frame_pause_)));
}

void Sender::owe_statement(const Ledger& ledger, const Ledger::Contribution& contribution,
                           Instant at) noexcept {
  Due& due = due_of(ledger, contribution);
  due.statement = std::min(due.statement, std::max(at, due.statement_sent + kBetweenRepeats));
}

void Sender::drop_frame(const Ledger& ledger, const Ledger::Contribution& contribution) noexcept {
  due_of(ledger, contribution).frame = Instant::never();
}

void Sender::drop_statement(const Ledger& ledger,
                            const Ledger::Contribution& contribution) noexcept {
  due_of(ledger, contribution).statement = Instant::never();
}

void Sender::begin_own(const Ledger& ledger) noexcept {
  sent_ = 0;
  fresh_first_ = fresh_count_ = 0;
  for (Batch& batch : batches_) batch.range = {};
  announce_due_ = Instant::long_ago();
  if (ledger.publishing() == nullptr) return;
  owe_frame(ledger, *ledger.publishing(), Instant::long_ago());
  owe_statement(ledger, *ledger.publishing(), Instant::long_ago());
}

/// A pause of a day fills the budget as one of some minutes does, and nothing overflows.
void Sender::earn(Instant now) noexcept {
  constexpr std::int64_t kMostElapsed_us = 1'000'000'000;
  if (budget_at_ == Instant::long_ago()) {
    budget_bytes_ = burst_bytes_;
    budget_at_ = now;
  }
  const std::int64_t elapsed_us =
      std::clamp<std::int64_t>((now - budget_at_).us, 0, kMostElapsed_us);
  const std::int64_t earned = elapsed_us * bytes_per_s_ / 1'000'000;
  if (earned == 0) return;
  budget_at_ = now;
  budget_bytes_ = std::min(burst_bytes_, budget_bytes_ + earned);
}

std::size_t Sender::send(Gate& gate, Ledger& ledger, Repair& repair, Instant now,
                         std::span<std::byte> into, ExchangeReport& counted) noexcept {
  TESSERA_ASSERT(into.size() >= kMostDatagramBytes);
  earn(now);
  if (budget_bytes_ < static_cast<std::int64_t>(kMostDatagramBytes)) return 0;
  Making make{.gate = gate, .ledger = ledger, .repair = repair, .now = now, .counted = counted};
  ByteWriter to(into.first(kMostDatagramBytes - kTagBytes));
  DatagramHeader header{.kind = make.kind,
                        .mission = mission_,
                        .configuration = gate.configuration(),
                        .sender = robot_,
                        .session = session_,
                        .sequence = 0,
                        .is_signed = gate.signatures().on()};
  write_header(to, header);
  needs_signature_ = header.is_signed;
  if (!write_body(make, to)) return 0;
  TESSERA_ASSERT(to.ok());
  header.kind = make.kind;
  header.sequence = is_control(header.kind) ? ++control_sequence_ : ++data_sequence_;
  ByteWriter again(into.first(kHeaderBytes));
  write_header(again, header);
  const std::size_t tagged = append_signature(make, into, to.size());
  const std::size_t size = tagged + kTagBytes;
  const Authenticator& authenticator = gate.authenticator();
  authenticator.tag(authenticator.context, into.first(tagged),
                    into.subspan(tagged).first<kTagBytes>());
  budget_bytes_ -= static_cast<std::int64_t>(size);
  ++counted.sent;
  counted.sent_bytes += size;
  if (make.for_asker) {
    counted.answer_bytes += size;
    if (Peer* const peer = gate.peers().find(make.asker); peer != nullptr)
      Answers::charge(*peer, size);
  }
  return size;
}

/// Appends the signature of what is about to be sent, if it has one. Returns the new size.
std::size_t Sender::append_signature(Making& make, std::span<std::byte> into,
                                     std::size_t size) noexcept {
  if (!needs_signature_) return size;
  const Signatures& signatures = make.gate.signatures();
  const auto at = into.subspan(size).first<kSignatureBytes>();
  if (is_control(make.kind)) {
    signatures.sign(signatures.context, into.first(size), at);
  } else {
    std::copy(signature_.begin(), signature_.end(), at.begin());
  }
  return size + kSignatureBytes;
}

bool Sender::write_body(Making& make, ByteWriter& to) noexcept {
  if (leave_due_) {
    leave_due_ = false;
    make.kind = DatagramKind::kLeave;
    return true;
  }
  if (announce_soon_ || make.gate.wants_to_announce(make.now)) {
    announce_due_ = std::min(announce_due_, make.now + announce_soon_time_);
    announce_soon_ = false;
  }
  ByteWriter before_signature = to;
  if (needs_signature_) before_signature.keep_free(kSignatureBytes);
  const bool any =
      write_due_frame(make, before_signature) || write_due_statement(make, before_signature) ||
      write_due_conflict(make, before_signature) || write_announcement(make, before_signature) ||
      [&] {
        make.kind = DatagramKind::kRequest;
        return make.repair.write(make.ledger, before_signature, make.now, make.counted);
      }();
  if (any) {
    to = before_signature;
    return true;
  }
  return write_chunk(make, to);
}

}  // namespace tessera
