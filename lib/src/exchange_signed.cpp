// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Signatures of what is said and heard, where the fleet has them.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

/// Of control messages: message ends with its sender's signature of what is before it. Chunks and
/// frames are checked when they are news.
bool Exchange::is_signed_by_sender(const DatagramHeader& header,
                                   std::span<const std::byte> message) const noexcept {
  if (!signatures_.on() || !is_control(header.kind)) return true;
  if (message.size() < kHeaderBytes + kSignatureBytes) return false;
  return signatures_.check(signatures_.context, header.sender,
                           message.first(message.size() - kSignatureBytes),
                           message.last<kSignatureBytes>());
}

/// Grows the tree of a chunk's records, and checks the signature of its root if one is news.
Exchange::Taken Exchange::check_chunk(const Contribution& contribution, const ChunkHeader& header,
                                      ByteReader records) noexcept {
  RecordReader reader(records, header);
  ChunkRecord record;
  bool news = false;
  tree_.clear();
  while (records.remaining() != 0) {
    if (tree_.full() || !reader.read(record)) return {.well_formed = false};
    const Result<BlockKey> key = pack(record.block);
    TESSERA_ASSERT(key.ok());
    news = news || store_.replicas->news(contribution.slot, *key, record.version) != 0;
    tree_.add(leaf_of(signatures_, header.id, record));
  }
  if (!news) return {};
  const auto message =
      root_message(configuration_, header.id, tree_.count(), tree_.root(signatures_));
  return {.forged = !signatures_.check(signatures_.context, header.id.robot, message, signature_)};
}

/// What is kept beside a record: its code, and with signatures its proof before it, none for what
/// this robot itself says: that is signed when it is sent.
std::span<const std::byte> Exchange::to_keep(std::span<const std::byte> coded,
                                             std::span<const std::byte> proof) const noexcept {
  if (!signatures_.on()) return coded;
  ByteWriter to(kept_);
  to.u8(static_cast<std::uint8_t>(proof.size()));
  to.bytes(proof);
  to.bytes(coded);
  TESSERA_ASSERT(to.ok());
  return to.written();
}

/// Appends the signature of what is about to be sent, if it has one. Returns the new size.
std::size_t Exchange::sign(DatagramKind kind, std::span<std::byte> into,
                           std::size_t size) noexcept {
  if (!signatures_.on() || (kind == DatagramKind::kChunk && proofs_)) return size;
  const auto at = into.subspan(size).first<kSignatureBytes>();
  if (is_control(kind)) {
    signatures_.sign(signatures_.context, into.first(size), at);
  } else {
    std::copy(signature_.begin(), signature_.end(), at.begin());
  }
  return size + kSignatureBytes;
}

}  // namespace tessera
