// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/record_proof.hpp"

#include <algorithm>

namespace tessera {

namespace {

constexpr std::size_t kRecordLeafBytes = 1 + 12 + RecordFacts::kBytes;
constexpr std::size_t kStatementLeafBytes = 1 + 12 + 8 + 36 + 8;
constexpr std::size_t kFrameLeafBytes = 1 + FramesHeader::kBytes + kMostFrameBytes;
/// The first byte of what is hashed, so that no leaf and no node can pass for another kind.
constexpr std::uint8_t kRecordLeaf = 0;
constexpr std::uint8_t kStatementLeaf = 2;
constexpr std::uint8_t kFrameLeaf = 3;

/// As the header of a datagram of that kind begins, so that nothing is signed for two uses.
void write_use(ByteWriter& to, DatagramKind kind, std::uint32_t configuration) noexcept {
  to.u8('T');
  to.u8('S');
  to.u8(2);
  to.u8(static_cast<std::uint8_t>(kind));
  to.u32(configuration);
}

Hash hash_of(const Signatures& by, std::span<const std::byte> message) noexcept {
  if (!by.on()) return plain_hash(message);
  Hash hash{};
  by.hash(by.context, message, hash);
  return hash;
}

}  // namespace

RecordFacts facts_of(const Signatures& by, const ChunkRecord& record) noexcept {
  return {.version = record.version.number,
          .first = record.version.first,
          .layers = record.version.layers,
          .block = record.block,
          .code = hash_of(by, record.coded)};
}

void write_facts(ByteWriter& to, const RecordFacts& facts) noexcept {
  to.u32(facts.version);
  to.u32(facts.first);
  to.u8(facts.layers);
  to.i32(facts.block.x);
  to.i32(facts.block.y);
  to.i32(facts.block.z);
  to.bytes(facts.code);
}

bool read_facts(ByteReader& from, RecordFacts& facts) noexcept {
  facts.version = from.u32();
  facts.first = from.u32();
  facts.layers = from.u8();
  facts.block = {from.i32(), from.i32(), from.i32()};
  const std::span<const std::byte> code = from.bytes(kHashBytes);
  std::copy(code.begin(), code.end(), facts.code.begin());
  return from.ok();
}

Hash leaf_of(const Signatures& by, const ContributionId& id, const ChunkRecord& record) noexcept {
  return leaf_of(by, id, facts_of(by, record));
}

Hash leaf_of(const Signatures& by, const ContributionId& id, const RecordFacts& facts) noexcept {
  std::array<std::byte, kRecordLeafBytes> message{};
  ByteWriter to(message);
  to.u8(kRecordLeaf);
  write_id(to, id);
  write_facts(to, facts);
  TESSERA_ASSERT(to.ok());
  return hash_of(by, to.written());
}

Hash leaf_of(const Signatures& by, const Statement& statement) noexcept {
  std::array<std::byte, kStatementLeafBytes> message{};
  ByteWriter to(message);
  to.u8(kStatementLeaf);
  const bool written = write_statement(to, statement);
  TESSERA_ASSERT(written && to.ok());
  static_cast<void>(written);
  return hash_of(by, to.written());
}

Hash leaf_of(const Signatures& by, const FrameBody& frame) noexcept {
  std::array<std::byte, kFrameLeafBytes> message{};
  ByteWriter to(message);
  to.u8(kFrameLeaf);
  const bool written = write_frame(to, frame);
  TESSERA_ASSERT(written);
  static_cast<void>(written);
  return hash_of(by, to.written());
}

RecordHash record_hash(const Hash& leaf) noexcept {
  ByteReader from(leaf);
  RecordHash hash;
  hash.high = from.u64();
  hash.low = from.u64();
  return hash;
}

Hash leaf_of(const RecordHash& hash) noexcept {
  Hash leaf{};
  ByteWriter to(leaf);
  to.u64(hash.high);
  to.u64(hash.low);
  return leaf;
}

std::array<std::byte, kRootMessageBytes> root_message(std::uint32_t configuration, const TreeOf& of,
                                                      std::uint32_t leaves,
                                                      const Hash& root) noexcept {
  std::array<std::byte, kRootMessageBytes> message{};
  ByteWriter to(message);
  write_use(to, of.kind, configuration);
  write_id(to, of.id);
  to.u8(static_cast<std::uint8_t>(leaves));
  to.bytes(root);
  return message;
}

std::size_t write_proof(const HashTree& tree, std::uint32_t leaf, const Signature& signature,
                        std::span<std::byte, kMostProofBytes> into) noexcept {
  std::array<Hash, HashTree::kMostPath> path{};
  const std::uint32_t length = tree.path(leaf, path);
  ByteWriter to(into);
  to.u8(static_cast<std::uint8_t>(leaf | (tree.count() - 1) << 4U));
  for (const Hash& hash : std::span(path).first(length)) to.bytes(hash);
  to.bytes(signature);
  return to.size();
}

std::span<const std::byte> read_proof(ByteReader& from) noexcept {
  ByteReader ahead = from;
  const std::uint8_t place = ahead.u8();
  const std::uint32_t leaf = place & 0xfU;
  const std::uint32_t leaves = 1U + (place >> 4U);
  // What cannot be is longer than anything.
  const std::size_t hashes =
      leaf < leaves ? HashTree::path_length(leaf, leaves) : kMostDatagramBytes;
  return from.bytes(1 + hashes * kHashBytes + kSignatureBytes);
}

bool ProofCheck::check(const Signatures& by, std::uint32_t configuration, const TreeOf& of,
                       const Hash& leaf, std::span<const std::byte> proof) noexcept {
  ByteReader from(proof);
  const std::uint8_t place = from.u8();
  const std::uint32_t index = place & 0xfU;
  const std::uint32_t leaves = 1U + (place >> 4U);
  std::array<Hash, HashTree::kMostPath> path{};
  const std::span<Hash> way = std::span(path).first(HashTree::path_length(index, leaves));
  for (Hash& hash : way) {
    const std::span<const std::byte> bytes = from.bytes(kHashBytes);
    std::copy(bytes.begin(), bytes.end(), hash.begin());
  }
  const std::span<const std::byte> given = from.bytes(kSignatureBytes);
  if (!from.ok() || index >= leaves) return false;
  const Hash root = HashTree::climb(by, leaf, index, leaves, way);
  const auto message = root_message(configuration, of, leaves, root);
  if (known_ && std::equal(message.begin(), message.end(), message_.begin()) &&
      std::equal(given.begin(), given.end(), signature_.begin()))
    return true;
  if (!by.check(by.context, of.id.robot, message, given.first<kSignatureBytes>())) return false;
  message_ = message;
  std::copy(given.begin(), given.end(), signature_.begin());
  known_ = true;
  return true;
}

}  // namespace tessera
