// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "fuzz/forged_signature.hpp"

#include <algorithm>
#include <array>

#include "network/toy_signatures.hpp"
#include "tessera/exchange/conflicts.hpp"

namespace tessera::fuzz {

namespace {

class Signer {
 public:
  Signer(Datagram& datagram, const DatagramHeader& header)
      : all_(datagram), header_(header), message_(all_.first(all_.size() - kTagBytes)) {}

  /// How many signatures were right before.
  int run() {
    if (is_control(header_.kind)) return sign_end(header_.sender, but_signature());
    switch (header_.kind) {
      case DatagramKind::kFrame:
        return sign_frames();
      case DatagramKind::kChunk:
        return sign_chunk();
      case DatagramKind::kConflict:
        return sign_conflict();
      default:
        return sign_statement();
    }
  }

 private:
  [[nodiscard]] std::span<std::byte> body() const { return message_.subspan(kHeaderBytes); }
  [[nodiscard]] bool has_room() const { return body().size() >= kSignatureBytes; }
  [[nodiscard]] Bytes but_signature() const {
    return message_.first(has_room() ? message_.size() - kSignatureBytes : 0);
  }

  static int put(std::uint32_t robot, Bytes message, std::span<std::byte> place) {
    network::ToySignatures key(robot);
    const Signatures by = key.signatures();
    Signature wanted{};
    by.sign(by.context, message, wanted);
    const bool was_right = std::equal(wanted.begin(), wanted.end(), place.begin());
    std::copy(wanted.begin(), wanted.end(), place.begin());
    return was_right ? 1 : 0;
  }
  int sign_end(std::uint32_t robot, Bytes message) const {
    return has_room() ? put(robot, message, message_.last(kSignatureBytes)) : 0;
  }

  int sign_frames() const {
    FramesHeader header;
    ByteReader whole(body());
    if (!read_frames_header(whole, header)) return 0;
    std::size_t frames = whole.remaining();
    if (!header.relayed && frames < kSignatureBytes) return 0;
    if (!header.relayed) frames -= kSignatureBytes;
    ByteReader from(whole.bytes(frames));
    FrameReader reader(from, header.robot, header.relayed);
    FrameBody frame;
    Bytes proof;
    HashTree tree;
    int right = 0;
    while (from.remaining() != 0 && reader.read(frame, proof)) {
      const Hash leaf = leaf_of(hashing(), frame);
      if (header.relayed) {
        right += sign_leaf(TreeOf::frames(header.robot), leaf, proof);
      } else {
        tree.add(leaf);
      }
    }
    if (header.relayed || tree.count() == 0) return right;
    return sign_root(TreeOf::frames(header.robot), tree);
  }

  /// proof: bytes of the datagram.
  int sign_leaf(const TreeOf& of, const Hash& leaf, Bytes proof) const {
    ByteReader from(proof);
    const unsigned place = from.u8();
    const std::uint32_t index = place & 0xfU;
    const std::uint32_t leaves = 1U + (place >> 4U);
    if (index >= leaves) return 0;
    std::array<Hash, HashTree::kMostPath> path{};
    const auto way = std::span(path).first(HashTree::path_length(index, leaves));
    for (Hash& hash : way) {
      const Bytes bytes = from.bytes(kHashBytes);
      std::copy(bytes.begin(), bytes.end(), hash.begin());
    }
    if (!from.ok() || from.remaining() != kSignatureBytes) return 0;
    const Hash root = HashTree::climb(hashing(), leaf, index, leaves, way);
    const auto at = static_cast<std::size_t>(proof.data() - all_.data());
    return put(of.id.robot, root_message(header_.configuration, of, leaves, root),
               all_.subspan(at + proof.size() - kSignatureBytes, kSignatureBytes));
  }

  int sign_root(const TreeOf& of, HashTree& tree) const {
    const Hash root = tree.root(hashing());
    return sign_end(of.id.robot, root_message(header_.configuration, of, tree.count(), root));
  }

  int sign_statement() const {
    Statement statement;
    ByteReader from(body());
    if (!read_statement(from, statement)) return 0;
    return sign_leaf(statement.id, leaf_of(hashing(), statement), read_proof(from));
  }

  int sign_conflict() const {
    ConflictBody conflict;
    ByteReader from(body());
    if (!read_conflict(from, conflict)) return 0;
    int right = 0;
    for (const ConflictBody::Side& side : conflict.side) {
      right += sign_leaf(conflict.id,
                         conflict.of_statements ? leaf_of(hashing(), side.statement)
                                                : leaf_of(hashing(), conflict.id, side.record),
                         side.proof);
    }
    return right;
  }

  int sign_chunk() const {
    ChunkHeader chunk;
    ByteReader whole(body());
    if (!read_chunk_header(whole, header_.session, chunk)) return 0;
    std::size_t records = whole.remaining();
    if (!chunk.relayed && records < kSignatureBytes) return 0;
    if (!chunk.relayed) records -= kSignatureBytes;
    ByteReader from(whole.bytes(records));
    RecordReader reader(from, chunk.range, chunk.relayed);
    ChunkRecord record;
    HashTree tree;
    int right = 0;
    while (from.remaining() != 0 && reader.read(record)) {
      const Hash leaf = leaf_of(hashing(), chunk.id, record);
      if (chunk.relayed) {
        right += sign_leaf(chunk.id, leaf, record.proof);
      } else {
        if (tree.count() + 1 >= HashTree::kMostLeaves) return 0;
        tree.add(leaf);
      }
    }
    if (chunk.relayed) return right;
    tree.add(leaf_of(hashing(), chunk.statement));
    return sign_root(chunk.id, tree);
  }

  static const Signatures& hashing() {
    static network::ToySignatures key(0);
    static const Signatures by = key.signatures();
    return by;
  }

  std::span<std::byte> all_;
  DatagramHeader header_;
  std::span<std::byte> message_;
};

}  // namespace

int sign(Datagram& datagram) {
  if (datagram.size() < kHeaderBytes + kTagBytes) return 0;
  DatagramHeader header;
  ByteReader reader(Bytes(datagram).first(kHeaderBytes));
  if (!read_header(reader, header)) return 0;
  return Signer(datagram, header).run();
}

}  // namespace tessera::fuzz
