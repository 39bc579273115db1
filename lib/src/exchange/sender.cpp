// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/sender.hpp"

#include <algorithm>

namespace tessera {

Result<Sender> Sender::make(Arena& arena, const ExchangeConfig& config) noexcept {
  Sender sender;
  sender.robot_ = config.robot;
  sender.session_ = config.session;
  sender.mission_ = config.mission;
  sender.bytes_per_s_ = config.bytes_per_s;
  sender.burst_bytes_ = config.burst_bytes;
  sender.presence_ = PresenceSender(config);
  const Result<ControlWriter> control = ControlWriter::make(arena, config);
  const Result<ChunkWriter> chunks = ChunkWriter::make(arena, config);
  sender.tree_ = arena.take<HashTree>(1).data();
  if (!control.ok() || !chunks.ok() || sender.tree_ == nullptr) return Status::kResourceExhausted;
  sender.control_ = *control;
  sender.chunks_ = *chunks;
  return sender;
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
  Outgoing out{.gate = gate,
               .ledger = ledger,
               .repair = repair,
               .now = now,
               .tree = *tree_,
               .counted = counted,
               .data_sequence = data_sequence_,
               .needs_signature = gate.signatures().on()};
  ByteWriter to(into.first(kMostDatagramBytes - kTagBytes));
  DatagramHeader header{.kind = out.kind,
                        .mission = mission_,
                        .configuration = gate.configuration(),
                        .sender = robot_,
                        .session = session_,
                        .sequence = 0,
                        .is_signed = out.needs_signature};
  write_header(to, header);
  if (!write_body(out, to)) return 0;
  TESSERA_ASSERT(to.ok());
  header.kind = out.kind;
  header.sequence = is_control(header.kind) ? ++control_sequence_ : ++data_sequence_;
  ByteWriter again(into.first(kHeaderBytes));
  write_header(again, header);
  const std::size_t tagged = append_signature(out, into, to.size());
  const std::size_t size = tagged + kTagBytes;
  const Authenticator& authenticator = gate.authenticator();
  authenticator.tag(authenticator.context, into.first(tagged),
                    into.subspan(tagged).first<kTagBytes>());
  budget_bytes_ -= static_cast<std::int64_t>(size);
  ++counted.sent;
  counted.sent_bytes += size;
  if (out.for_asker) {
    counted.answer_bytes += size;
    if (Peer* const peer = gate.peers().find(out.asker); peer != nullptr)
      Answers::charge(*peer, size);
  }
  return size;
}

/// Appends the signature of what is about to be sent, if it has one. Returns the new size.
std::size_t Sender::append_signature(Outgoing& out, std::span<std::byte> into,
                                     std::size_t size) noexcept {
  if (!out.needs_signature) return size;
  const Signatures& signatures = out.gate.signatures();
  const auto at = into.subspan(size).first<kSignatureBytes>();
  if (is_control(out.kind)) {
    signatures.sign(signatures.context, into.first(size), at);
  } else {
    std::copy(out.signature.begin(), out.signature.end(), at.begin());
  }
  return size + kSignatureBytes;
}

/// With the announcement, if that is due as well.
bool Sender::write_presence(Outgoing& out, ByteWriter& to) noexcept {
  const bool announces = control_.announces(out.now);
  if (!presence_.is_due(out.now, announces) || !presence_.write(to, out.now)) return false;
  if (announces) static_cast<void>(control_.write_announcement(out, to));
  out.kind = DatagramKind::kPresence;
  ++out.counted.presences;
  return true;
}

bool Sender::write_body(Outgoing& out, ByteWriter& to) noexcept {
  if (leave_due_) {
    leave_due_ = false;
    out.kind = DatagramKind::kLeave;
    return true;
  }
  if (announce_soon_ || out.gate.wants_to_announce(out.now)) control_.announce_soon(out.now);
  announce_soon_ = false;
  ByteWriter before_signature = to;
  if (out.needs_signature) before_signature.keep_free(kSignatureBytes);
  const bool any =
      write_presence(out, before_signature) || control_.write(out, before_signature) || [&] {
        out.kind = DatagramKind::kRequest;
        return out.repair.write(out.ledger, before_signature, out.now, out.counted);
      }();
  if (any) {
    to = before_signature;
    return true;
  }
  return chunks_.write(out, to);
}

}  // namespace tessera
