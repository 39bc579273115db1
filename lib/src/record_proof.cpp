// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/record_proof.hpp"

#include <algorithm>

namespace tessera {

namespace {

constexpr std::size_t kLeafHeaderBytes = 1 + 12 + 4 + 4 + 1 + 12;
/// One code is at most that long where it came in a datagram.
constexpr std::size_t kMostLeafBytes = kLeafHeaderBytes + kMostBodyBytes;

void write_id(ByteWriter& to, const ContributionId& id) noexcept {
  to.u32(id.robot);
  to.u32(id.epoch);
  to.u32(id.submap);
}

/// As the header of a datagram of that kind begins, so that nothing is signed for two uses.
void write_use(ByteWriter& to, DatagramKind kind, std::uint32_t configuration) noexcept {
  to.u8('T');
  to.u8('S');
  to.u8(1);
  to.u8(static_cast<std::uint8_t>(kind));
  to.u32(configuration);
}

}  // namespace

Hash leaf_of(const Signatures& by, const ContributionId& id, const ChunkRecord& record) noexcept {
  std::array<std::byte, kMostLeafBytes> message{};
  ByteWriter to(message);
  to.u8(0);
  write_id(to, id);
  to.u32(record.version.number);
  to.u32(record.version.first);
  to.u8(record.version.layers);
  to.i32(record.block.x);
  to.i32(record.block.y);
  to.i32(record.block.z);
  to.bytes(record.coded);
  TESSERA_ASSERT(to.ok());
  Hash hash{};
  by.hash(by.context, to.written(), hash);
  return hash;
}

std::array<std::byte, kRootMessageBytes> root_message(std::uint32_t configuration,
                                                      const ContributionId& id,
                                                      std::uint32_t leaves,
                                                      const Hash& root) noexcept {
  std::array<std::byte, kRootMessageBytes> message{};
  ByteWriter to(message);
  write_use(to, DatagramKind::kChunk, configuration);
  write_id(to, id);
  to.u8(static_cast<std::uint8_t>(leaves));
  to.bytes(root);
  return message;
}

std::array<std::byte, kFrameMessageBytes> frame_message(std::uint32_t configuration,
                                                        const FrameBody& frame) noexcept {
  std::array<std::byte, kFrameMessageBytes> message{};
  ByteWriter to(message);
  write_use(to, DatagramKind::kFrame, configuration);
  write_frame(to, frame);
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

bool ProofCheck::check(const Signatures& by, std::uint32_t configuration, const ContributionId& id,
                       const ChunkRecord& record) noexcept {
  ByteReader from(record.proof);
  const std::uint8_t place = from.u8();
  const std::uint32_t leaf = place & 0xfU;
  const std::uint32_t leaves = 1U + (place >> 4U);
  std::array<Hash, HashTree::kMostPath> path{};
  const std::span<Hash> way = std::span(path).first(HashTree::path_length(leaf, leaves));
  for (Hash& hash : way) {
    const std::span<const std::byte> bytes = from.bytes(kHashBytes);
    std::copy(bytes.begin(), bytes.end(), hash.begin());
  }
  const std::span<const std::byte> given = from.bytes(kSignatureBytes);
  if (!from.ok()) return false;
  const Hash root = HashTree::climb(by, leaf_of(by, id, record), leaf, leaves, way);
  const auto message = root_message(configuration, id, leaves, root);
  if (known_ && std::equal(message.begin(), message.end(), message_.begin()) &&
      std::equal(given.begin(), given.end(), signature_.begin()))
    return true;
  if (!by.check(by.context, id.robot, message, given.first<kSignatureBytes>())) return false;
  message_ = message;
  std::copy(given.begin(), given.end(), signature_.begin());
  known_ = true;
  return true;
}

}  // namespace tessera
