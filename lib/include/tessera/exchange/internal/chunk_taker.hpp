// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Takes the records of chunks: reads and checks them, and puts into the store what is news. A
// record that its origin did not sign, in a fleet that signs, is none.
#pragma once

#include <optional>

#include "tessera/exchange/conflicts.hpp"
#include "tessera/exchange/internal/held_records.hpp"

namespace tessera {

class ChunkTaker {
 public:
  /// What a chunk did.
  struct Taken {
    bool well_formed = true;
    bool grew = false;          ///< Something was new, if only that there is no more.
    std::uint32_t records = 0;  ///< That were new.
    std::uint32_t held = 0;     ///< That are the latest of their blocks here now.
    bool refused = false;       ///< There was no room for some.
    bool forged = false;        ///< Its origin did not sign what it says.
  };

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<HashTree>(1);
  }
  /// configuration: as in a datagram's header. Fails with kResourceExhausted iff the arena is too
  /// small.
  [[nodiscard]] static Result<ChunkTaker> make(Arena& arena, const Signatures& signatures,
                                               std::uint32_t configuration,
                                               int num_components) noexcept;
  ChunkTaker() noexcept = default;

  /// Where records go, and what contradicts them.
  struct Into {
    ContributionTable& table;
    HeldRecords& records;
    Conflicts& conflicts;
    BlockContent& scratch;
    ExchangeReport& counted;
  };
  /// The lowest epochs of a robot that count.
  struct Floors {
    std::uint32_t all = 0;
    std::uint32_t sessions = 0;
  };
  /// Takes the records of a chunk. contribution: open, not this robot's; floors: of its robot;
  /// awaited: count held ones. A check of a signature, or one for each record; for each record that
  /// is news decoding and a put.
  [[nodiscard]] Taken take(const Into& into, HeldContribution& contribution, const Floors& floors,
                           const ChunkHeader& header, std::span<const std::byte> body,
                           bool awaited) noexcept;
  /// The proof of the statement that came with the chunk that was taken last; none without
  /// signatures.
  [[nodiscard]] std::span<const std::byte> statement_proof() noexcept;
  /// Of a chunk of this process's own that another robot sent: Taken::held; nothing if it holds
  /// records that this process did not make.
  [[nodiscard]] std::optional<std::uint32_t> check_own(const HeldRecords& records,
                                                       const HeldContribution& own,
                                                       const ChunkHeader& header,
                                                       std::span<const std::byte> body,
                                                       bool awaited) noexcept;
  /// Checks of proofs, which know the last signature that was right.
  [[nodiscard]] ProofCheck& proofs() noexcept { return proof_check_; }

 private:
  enum class Fate : std::uint8_t { kTaken, kStale, kNoRoom, kMalformed, kForged };
  [[nodiscard]] Taken check_signed(const HeldRecords& records, const HeldContribution& contribution,
                                   const Floors& floors, const ChunkHeader& header,
                                   std::span<const std::byte> bytes, bool awaited) noexcept;
  [[nodiscard]] Taken take_records(const Into& into, HeldContribution& contribution,
                                   const ChunkHeader& header,
                                   std::span<const std::byte> bytes) noexcept;
  [[nodiscard]] static bool is_statement(const ContributionId& id, BlockKey place,
                                         const ChunkRecord& record) noexcept;
  [[nodiscard]] Fate take_record(const Into& into, HeldContribution& contribution,
                                 const ChunkHeader& header, std::uint32_t leaf_number,
                                 ChunkRecord& record) noexcept;
  void note_conflict(const Into& into, const HeldContribution& contribution,
                     const ChunkRecord& record, const Replicas::Replica* other) const noexcept;
  [[nodiscard]] std::uint32_t count_held(const HeldRecords& records,
                                         const HeldContribution& contribution,
                                         const ChunkHeader& header,
                                         std::span<const std::byte> bytes) noexcept;

  Signatures signatures_{};
  std::uint32_t configuration_ = 0;
  int num_components_ = 0;
  HashTree* tree_ = nullptr;  ///< Of the records of a chunk, and its statement.
  Signature signature_{};     ///< Of the chunk at hand.
  std::array<std::byte, kMostProofBytes> proof_{};  ///< Of its statement.
  ProofCheck proof_check_{};
};

}  // namespace tessera
