// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Chunks that arrive.
#include "tessera/exchange/internal/message_taker.hpp"

namespace tessera {

bool MessageTaker::hear_chunk(const ExchangeParts& parts, const Heard& heard) noexcept {
  ByteReader body(heard.body);
  if (!read_chunk_header(body, heard.header.session, *chunk_)) return false;
  const std::span<const std::byte> rest = heard.body.last(body.remaining());
  if (parts.is_refused(chunk_->id, heard, announce_)) return true;
  // Only an origin sends without proofs.
  if (!chunk_->relayed && chunk_->id.robot != heard.header.sender) return false;
  if (parts.ledger.is_of_this_process(chunk_->id)) {
    hear_own_chunk(parts, heard, rest);
    return true;
  }
  const bool is_far = parts.ledger.far().find(chunk_->id) != nullptr;
  HeldContribution* const contribution =
      is_far ? nullptr : parts.ledger.note_name(chunk_->id, heard.now, parts.counted);
  const bool is_unwanted = contribution != nullptr && contribution->open && contribution->far;
  if (is_far || is_unwanted) ++parts.counted.far_chunks;
  if (contribution == nullptr || contribution->own || is_unwanted) return true;
  if (!contribution->open) {
    ++parts.counted.records_early;
    parts.repair.note_lack(parts.ledger, *contribution, heard.now);
    return true;
  }
  const std::uint64_t before = parts.ledger.records().taken_bytes();
  const ChunkTaker::Taken taken = parts.ledger.take_chunk(
      *contribution, *chunk_, rest, is_awaited(parts, *contribution), parts.counted);
  // It has these itself: they are no reason to answer it more.
  if (Peer* const origin = parts.gate.peers().find(chunk_->id.robot); origin != nullptr)
    origin->allowance_taken += parts.ledger.records().taken_bytes() - before;
  if (taken.forged) ++parts.counted.refused_signature;
  if (taken.forged || !taken.well_formed) {
    parts.repair.note_taken(parts.ledger, *contribution, taken, false, heard.header.sender,
                            heard.now);
    return taken.well_formed;
  }
  const bool fills = chunk_->relayed || chunk_->range.first <= contribution->latest;
  if (!chunk_->relayed) {
    if (heard.is_last) contribution->origin_at = heard.now;
    parts.ledger.take_chunk_statement(*contribution, chunk_->statement, heard.is_last,
                                      parts.counted);
  }
  drop_answers(parts, heard, *contribution, taken.held);
  parts.repair.note_taken(parts.ledger, *contribution, taken, fills, heard.header.sender,
                          heard.now);
  return true;
}

/// Of what this process itself publishes.
void MessageTaker::hear_own_chunk(const ExchangeParts& parts, const Heard& heard,
                                  std::span<const std::byte> body) noexcept {
  const HeldContribution* const own = parts.ledger.find(chunk_->id);
  if (own == nullptr) {
    // Where robots sign, nothing is known by a name that anybody may say.
    parts.counted.impostors += parts.gate.signatures().on() ? 0U : 1U;
  } else if (const auto held =
                 parts.ledger.check_own_chunk(*own, *chunk_, body, is_awaited(parts, *own));
             held) {
    drop_answers(parts, heard, *own, *held);
  } else {
    ++parts.counted.impostors;
  }
}

/// What another robot sent needs no sending, if it had all of it.
void MessageTaker::drop_answers(const ExchangeParts& parts, const Heard& heard,
                                const HeldContribution& contribution,
                                std::uint32_t held) const noexcept {
  if (!heard.is_new || chunk_->partial || !is_awaited(parts, contribution) ||
      !parts.ledger.records().is_all_of(contribution, chunk_->range, held))
    return;
  parts.counted.answers_saved +=
      parts.sender.answers().drop(parts.ledger.number_of(contribution), chunk_->range);
}

}  // namespace tessera
