// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What an origin signs, so that no robot can speak for another: of records the root of a tree with
// a leaf for each, of a frame itself (docs/reference/wire-format.md). A record that is passed on
// carries its proof: its place in the tree, the path to the root, and the signature.
#pragma once

#include "tessera/exchange/internal/hash_tree.hpp"
#include "tessera/exchange/wire.hpp"

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
[[nodiscard]] RecordHash record_hash(const Hash& leaf) noexcept;
/// The leaf that such a hash is of.
[[nodiscard]] Hash leaf_of(const RecordHash& hash) noexcept;

/// What is signed of a tree. configuration: as in a datagram's header; evidence means nothing
/// without.
inline constexpr std::size_t kRootMessageBytes = 4 + 4 + 12 + 1 + kHashBytes;
[[nodiscard]] std::array<std::byte, kRootMessageBytes> root_message(std::uint32_t configuration,
                                                                    const ContributionId& id,
                                                                    std::uint32_t leaves,
                                                                    const Hash& root) noexcept;
/// What is signed of a frame. That of a session is longer.
class FrameMessage {
 public:
  FrameMessage(std::uint32_t configuration, const FrameBody& frame) noexcept;
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept {
    return std::span(bytes_).first(size_);
  }

 private:
  std::array<std::byte, 4 + 4 + 12 + 4 + 12 * sizeof(double) + 6 * sizeof(std::int32_t) + 18>
      bytes_{};
  std::size_t size_ = 0;
};

/// The proof of a leaf of a tree whose root was signed, in into. Returns its size.
[[nodiscard]] std::size_t write_proof(const HashTree& tree, std::uint32_t leaf,
                                      const Signature& signature,
                                      std::span<std::byte, kMostProofBytes> into) noexcept;
/// The bytes of a proof; none iff there is none, and then from is not ok any more.
[[nodiscard]] std::span<const std::byte> read_proof(ByteReader& from) noexcept;

/// Checks leaves by their proofs. Those that were signed together are mostly sent together, and
/// then one check of a signature does for all.
class ProofCheck {
 public:
  /// True iff the contribution's robot signed a tree with this leaf. proof: as read_proof() gives
  /// it. At most four hashes and one check of a signature.
  [[nodiscard]] bool check(const Signatures& by, std::uint32_t configuration,
                           const ContributionId& id, const Hash& leaf,
                           std::span<const std::byte> proof) noexcept;

 private:
  std::array<std::byte, kRootMessageBytes> message_{};
  Signature signature_{};
  bool known_ = false;  ///< The signature is of the message.
};

}  // namespace tessera
