// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Records of contributions: in the store, in their contribution's index, and in its fingerprint and
// number. In a fleet that signs, each is kept with its proof.
#pragma once

#include <optional>

#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/exchange/internal/contribution_table.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

class HeldRecords {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config,
                                                            int num_components) noexcept {
    return arena_bytes<RecordLink>(config.records) +
           arena_bytes<std::byte>(most_packed_bytes(num_components)) +
           arena_bytes<std::byte>(kMostKept);
  }
  /// signs: of the fleet. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<HeldRecords> make(Arena& arena, const ExchangeConfig& config,
                                                const ReplicaStore& store, bool signs,
                                                int num_components) noexcept;
  HeldRecords() noexcept = default;

  /// Puts a record into the store. content: what its code is of; proof: empty for what this robot
  /// itself publishes, which is signed when it is sent. Fails as ReplicaStore::put.
  [[nodiscard]] Result<Replicas::Change> put(ContributionTable& table,
                                             HeldContribution& contribution, BlockKey key,
                                             const PartVersion& version,
                                             const BlockContent& content,
                                             std::span<const std::byte> coded,
                                             std::span<const std::byte> proof) noexcept;
  /// The same where it is packed. packed: not of this one's scratch.
  [[nodiscard]] Result<Replicas::Change> put_packed(ContributionTable& table,
                                                    HeldContribution& contribution, BlockKey key,
                                                    const PartVersion& version,
                                                    std::span<const std::byte> packed,
                                                    std::span<const std::byte> coded,
                                                    std::span<const std::byte> proof) noexcept;
  /// The record with its code, and its proof if it has one. part: live. Into a scratch that lasts
  /// until the next call.
  [[nodiscard]] ChunkRecord read(const Replicas::Replica& part) noexcept;
  /// Adds what is held of a block to content. False: nothing, or an empty block. O(bytes).
  [[nodiscard]] bool read_block(const HeldContribution& contribution, BlockKey key,
                                BlockContent& content) const noexcept;
  /// Layers of a record that are not known in this version or a later one. O(parts).
  [[nodiscard]] bool is_news(const HeldContribution& contribution, BlockKey key,
                             const PartVersion& version) const noexcept {
    return store_.replicas->news(contribution.slot, key, version) != 0;
  }
  /// The live part of a block that has this version and this content, or null. O(parts).
  [[nodiscard]] const Replicas::Replica* find(const HeldContribution& contribution, BlockKey key,
                                              std::uint32_t version,
                                              const RecordHash& hash) const noexcept;
  /// A live part of the block that has the same version and other content: its origin made both.
  /// Or null. O(parts).
  [[nodiscard]] const Replicas::Replica* contradicted(const HeldContribution& contribution,
                                                      BlockKey key,
                                                      const PartVersion& version) const noexcept;
  /// The same in another block, among the records that an even spread of versions has in a bucket.
  [[nodiscard]] const Replicas::Replica* of_other_block(const HeldContribution& contribution,
                                                        const PartVersion& version) const noexcept;

  /// Of the records with a version the one at this place, or null, and how many there are: more
  /// than one only of who publishes a version twice. O(records in its bucket), which are visited.
  struct OfVersion {
    const Replicas::Replica* part = nullptr;
    std::uint32_t count = 0;
    std::size_t visited = 0;
  };
  [[nodiscard]] OfVersion find_version(const HeldContribution& contribution, std::uint32_t version,
                                       std::uint32_t place) const noexcept;
  /// True if there are at most held records of a range; false also where that is a long walk.
  [[nodiscard]] bool is_all_of(const HeldContribution& contribution, const VersionRange& range,
                               std::uint32_t held) const noexcept;

  [[nodiscard]] const Replicas& replicas() const noexcept { return *store_.replicas; }
  /// As ReplicaStore::fullness.
  [[nodiscard]] std::uint32_t fullness() const noexcept { return store_.fullness(store_.context); }
  [[nodiscard]] std::span<const RecordLink> links() const noexcept { return links_; }
  /// Bytes of records that were taken, codes and proofs, since the start.
  [[nodiscard]] std::uint64_t taken_bytes() const noexcept { return taken_bytes_; }

 private:
  static constexpr std::size_t kMostKept = 1 + kMostProofBytes + kMostCodedBytes;
  void list_block(ContributionTable& table, HeldContribution& contribution, BlockKey key,
                  bool add) noexcept;
  [[nodiscard]] std::span<const std::byte> to_keep(std::span<const std::byte> coded,
                                                   std::span<const std::byte> proof) const noexcept;

  ReplicaStore store_{};
  bool signs_ = false;
  std::span<RecordLink> links_;
  std::span<std::byte> packed_;  ///< Scratch for a packed block.
  std::span<std::byte> kept_;    ///< Scratch for what is kept of a record as it came.
  std::uint64_t taken_bytes_ = 0;
};

}  // namespace tessera
