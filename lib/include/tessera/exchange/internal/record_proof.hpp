// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What an origin signs, so that no robot can speak for another: the root of a tree with a leaf for
// each of the records of a chunk, or of the frames of a datagram (docs/reference/wire-format.md).
// What is passed on carries its proof: its place in the tree, the path to the root, and the
// signature.
#pragma once

#include <algorithm>

#include "tessera/exchange/internal/frames.hpp"

namespace tessera {

static_assert(kMostProofBytes == 1 + HashTree::kMostPath * kHashBytes + kSignatureBytes);

/// What of a record is hashed, beside its contribution's name. Its code is by a hash of its own, so
/// that a record can be shown to have been signed without its code.
struct RecordFacts {
  static constexpr std::size_t kBytes = 4 + 4 + 1 + 12 + kHashBytes;
  std::uint32_t version = 0;
  std::uint32_t first = 0;  ///< The version of the first part that was published with it.
  std::uint8_t layers = 0;
  BlockCoord block;
  Hash code{};
  friend bool operator==(const RecordFacts&, const RecordFacts&) = default;
};
[[nodiscard]] RecordFacts facts_of(const Signatures& by, const ChunkRecord& record) noexcept;
void write_facts(ByteWriter& to, const RecordFacts& facts) noexcept;
/// False iff there are not so many bytes.
[[nodiscard]] bool read_facts(ByteReader& from, RecordFacts& facts) noexcept;

/// The hash of a record's name and content: its leaf. With no signatures, by
/// plain_hash(). O(bytes of the record).
[[nodiscard]] Hash leaf_of(const Signatures& by, const ContributionId& id,
                           const ChunkRecord& record) noexcept;
[[nodiscard]] Hash leaf_of(const Signatures& by, const ContributionId& id,
                           const RecordFacts& facts) noexcept;
/// The same of a statement, the last leaf of the tree of its chunk.
[[nodiscard]] Hash leaf_of(const Signatures& by, const Statement& statement) noexcept;
/// The same of a frame.
[[nodiscard]] Hash leaf_of(const Signatures& by, const FrameBody& frame) noexcept;
[[nodiscard]] RecordHash record_hash(const Hash& leaf) noexcept;
/// The leaf that such a hash is of.
[[nodiscard]] Hash leaf_of(const RecordHash& hash) noexcept;

/// What the leaves of a tree are of.
struct TreeOf {
  /// Records of a contribution, and a statement.
  TreeOf(const ContributionId& contribution) noexcept : id(contribution) {}
  [[nodiscard]] static TreeOf frames(std::uint32_t robot) noexcept {
    TreeOf of{ContributionId{robot, 0, 0}};
    of.kind = DatagramKind::kFrame;
    return of;
  }
  ContributionId id;
  DatagramKind kind = DatagramKind::kChunk;
};

/// What is signed of a tree. configuration: as in a datagram's header; evidence means nothing
/// without.
inline constexpr std::size_t kRootMessageBytes = 4 + 4 + 12 + 1 + kHashBytes;
[[nodiscard]] std::array<std::byte, kRootMessageBytes> root_message(std::uint32_t configuration,
                                                                    const TreeOf& of,
                                                                    std::uint32_t leaves,
                                                                    const Hash& root) noexcept;
/// The proof of a leaf of a tree whose root was signed, in into. Returns its size.
[[nodiscard]] std::size_t write_proof(const HashTree& tree, std::uint32_t leaf,
                                      const Signature& signature,
                                      std::span<std::byte, kMostProofBytes> into) noexcept;
/// The bytes of a proof; none iff there is none, and then from is not ok any more.
[[nodiscard]] std::span<const std::byte> read_proof(ByteReader& from) noexcept;

/// A proof that is kept.
class KeptProof {
 public:
  void keep(std::span<const std::byte> proof) noexcept {
    TESSERA_ASSERT(proof.size() <= kMostProofBytes);
    size_ = static_cast<std::uint8_t>(proof.size());
    std::copy(proof.begin(), proof.end(), bytes_.begin());
  }
  /// None: none was kept.
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::span(bytes_).first(size_);
  }

 private:
  std::array<std::byte, kMostProofBytes> bytes_{};
  std::uint8_t size_ = 0;
};

/// Checks leaves by their proofs. Those that were signed together are mostly sent together, and
/// then one check of a signature does for all.
class ProofCheck {
 public:
  /// True iff the robot of what the tree is of signed one with this leaf. proof: as read_proof()
  /// gives it. At most four hashes and one check of a signature.
  [[nodiscard]] bool check(const Signatures& by, std::uint32_t configuration, const TreeOf& of,
                           const Hash& leaf, std::span<const std::byte> proof) noexcept;

 private:
  std::array<std::byte, kRootMessageBytes> message_{};
  Signature signature_{};
  bool known_ = false;  ///< The signature is of the message.
};

}  // namespace tessera
