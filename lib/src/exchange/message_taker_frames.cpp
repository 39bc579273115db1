// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames that arrive.
#include "tessera/exchange/internal/message_taker.hpp"

namespace tessera {

/// False iff one of them is invalid. Grows the tree that their origin signed; a relay's has proofs.
bool MessageTaker::read_frames(const ExchangeParts& parts, const FramesHeader& header,
                               std::span<const std::byte> frames) noexcept {
  const Signatures& signatures = parts.gate.signatures();
  ByteReader from(frames);
  FrameReader reader(from, header.robot, signatures.on() && header.relayed);
  FrameBody frame;
  std::span<const std::byte> proof;
  frames_->clear();
  while (from.remaining() != 0) {
    if (!reader.read(frame, proof) || !parts.ledger.is_valid(frame)) return false;
    if (signatures.on() && !header.relayed) frames_->add(leaf_of(signatures, frame));
  }
  if (frames_->count() != 0) static_cast<void>(frames_->root(signatures));
  return !frames.empty();
}

/// Nothing counts of a datagram in which any frame is invalid. One that is forged ends it: so a
/// datagram costs one check of a wrong signature.
bool MessageTaker::hear_frames(const ExchangeParts& parts, const Heard& heard) noexcept {
  const bool signs = parts.gate.signatures().on();
  ByteReader body(heard.body);
  FramesHeader header;
  if (!read_frames_header(body, header)) return false;
  if (!header.relayed && header.robot != heard.header.sender) return false;
  const bool at_end = signs && !header.relayed;
  if (at_end && body.remaining() < kSignatureBytes) return false;
  const auto frames = body.bytes(body.remaining() - (at_end ? kSignatureBytes : 0));
  if (!read_frames(parts, header, frames)) return false;
  Signature signature{};
  const auto end = body.bytes(body.remaining());
  std::copy(end.begin(), end.end(), signature.begin());
  ByteReader from(frames);
  FrameReader reader(from, header.robot, signs && header.relayed);
  FrameBody frame;
  std::span<const std::byte> proof;
  std::array<std::byte, kMostProofBytes> made{};
  for (std::uint32_t leaf = 0; from.remaining() != 0 && reader.read(frame, proof); ++leaf) {
    if (at_end) proof = std::span(made).first(write_proof(*frames_, leaf, signature, made));
    if (hear_frame(parts, heard, frame, proof)) continue;
    ++parts.counted.refused_signature;
    break;
  }
  return true;
}

/// False iff it is forged.
bool MessageTaker::hear_frame(const ExchangeParts& parts, const Heard& heard,
                              const FrameBody& frame,
                              std::span<const std::byte> proof) const noexcept {
  if (parts.ledger.is_of_this_process(frame.id)) {
    const bool is_known = parts.ledger.find(frame.id) != nullptr || parts.gate.signatures().on();
    parts.counted.impostors += is_known ? 0U : 1U;
    return true;
  }
  if (parts.is_refused(frame.id, heard, announce_)) return true;
  const HeldContribution* const before = parts.ledger.find(frame.id);
  if (before != nullptr && heard.is_new && before->has(frame))
    parts.sender.control().drop_frame(parts.ledger, *before);
  if (before != nullptr && before->open && parts.origin_speaks(*before, heard, announce_))
    return true;
  if (parts.far_origin_speaks(frame.id, heard, announce_)) return true;
  const bool is_last = heard.is_last && frame.id.robot == heard.header.sender;
  if (!parts.ledger.take_frame(frame, proof, is_last, heard.now, parts.counted)) return false;
  HeldContribution* const contribution = parts.ledger.find(frame.id);
  if (contribution != nullptr) parts.repair.note_lack(parts.ledger, *contribution, heard.now);
  return true;
}

}  // namespace tessera
