// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What an origin signs, so that no robot can speak for another: of records the root of a tree with
// a leaf for each, of a frame itself (docs/wire-format.md). A record that is passed on carries its
// proof: its place in the tree, the path to the root, and the signature.
#pragma once

#include "tessera/exchange/hash_tree.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {

static_assert(kMostProofBytes == 1 + HashTree::kMostPath * kHashBytes + kSignatureBytes);

/// What a record's leaf is. O(bytes of the record).
[[nodiscard]] Hash leaf_of(const Signatures& by, const ContributionId& id,
                           const ChunkRecord& record) noexcept;

/// What is signed of a tree. configuration: as in a datagram's header; evidence means nothing
/// without.
inline constexpr std::size_t kRootMessageBytes = 4 + 4 + 12 + 1 + kHashBytes;
[[nodiscard]] std::array<std::byte, kRootMessageBytes> root_message(std::uint32_t configuration,
                                                                    const ContributionId& id,
                                                                    std::uint32_t leaves,
                                                                    const Hash& root) noexcept;
/// What is signed of a frame.
inline constexpr std::size_t kFrameMessageBytes = 4 + 4 + 12 + 4 + 12 * sizeof(double);
[[nodiscard]] std::array<std::byte, kFrameMessageBytes> frame_message(
    std::uint32_t configuration, const FrameBody& frame) noexcept;

/// The proof of a leaf of a tree whose root was signed, in into. Returns its size.
[[nodiscard]] std::size_t write_proof(const HashTree& tree, std::uint32_t leaf,
                                      const Signature& signature,
                                      std::span<std::byte, kMostProofBytes> into) noexcept;
/// The bytes of a proof; none iff there is none, and then from is not ok any more.
[[nodiscard]] std::span<const std::byte> read_proof(ByteReader& from) noexcept;

/// Checks records by their proofs. Those that were signed together are mostly said together, and
/// then one check of a signature does for all.
class ProofCheck {
 public:
  /// True iff the record's origin signed it. record.proof: as read_proof() gives it. O(bytes of the
  /// record), and at most one check of a signature.
  [[nodiscard]] bool check(const Signatures& by, std::uint32_t configuration,
                           const ContributionId& id, const ChunkRecord& record) noexcept;

 private:
  std::array<std::byte, kRootMessageBytes> message_{};
  Signature signature_{};
  bool known_ = false;  ///< The signature is of the message.
};

}  // namespace tessera
