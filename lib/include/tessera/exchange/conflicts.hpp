// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Proofs that a robot signed two contents of one version of its contribution, or two statements of
// one moment. Each convinces everybody, so it is passed on to whoever has not got it. There are
// such proofs only in fleets that sign.
//
// Invariants: both signatures of every proof in the table are valid; there is one proof at most of
// each epoch of a robot, and kMostOfRobot at most of a robot.
#pragma once

#include "tessera/base/arena.hpp"
#include "tessera/base/instant.hpp"
#include "tessera/exchange/exchange_config.hpp"
#include "tessera/exchange/internal/record_proof.hpp"
#include "tessera/exchange/peer_table.hpp"

namespace tessera {

/// Two contents of one version, or two statements of one moment, each with the proof that the
/// contribution's robot signed it.
struct ConflictBody {
  /// One of the two.
  struct Side {
    RecordFacts record;   ///< Of records.
    Statement statement;  ///< Of statements.
    std::span<const std::byte> proof;
  };
  ContributionId id;
  bool of_statements = false;
  std::array<Side, 2> side{};
};
/// A name, the type, and two statements with their proofs.
inline constexpr std::size_t kMostConflictBytes = 12 + 1 + 2 * (64 + kMostProofBytes);
/// False iff it does not fit: then nothing of use was written.
[[nodiscard]] bool write_conflict(ByteWriter& to, const ConflictBody& conflict) noexcept;
/// False iff what is there is none; proofs are parts of what is read.
[[nodiscard]] bool read_conflict(ByteReader& from, ConflictBody& conflict) noexcept;

class Conflicts {
 public:
  /// Proofs that are kept, at most.
  static constexpr std::size_t kMost = 64;
  /// Proofs against different epochs of a robot after which it is excluded (ConflictPolicy).
  static constexpr std::uint32_t kMostOfRobot = 3;
  /// Proofs of other robots that are checked in a second, at most.
  static constexpr std::int64_t kChecksPerSecond = 20;

  /// A proof, and when it is sent next.
  struct Known {
    ContributionId id;
    std::uint16_t bytes = 0;
    std::array<std::byte, kMostConflictBytes> body{};
    Instant due = Instant::never();
    Instant sent;
  };

  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<Known>(kMost);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Conflicts> make(Arena& arena) noexcept;
  Conflicts() noexcept = default;

  /// The proof against an epoch of a robot, or null. O(kMost).
  [[nodiscard]] Known* find(std::uint32_t robot, std::uint32_t epoch) noexcept;
  /// Proofs against different epochs of this robot. O(kMost).
  [[nodiscard]] std::uint32_t count_of(std::uint32_t robot) const noexcept;
  [[nodiscard]] std::span<const Known> all() const noexcept { return known_.first(count_); }
  [[nodiscard]] std::span<Known> all() noexcept { return known_.first(count_); }
  /// True if a proof of this epoch would be kept.
  [[nodiscard]] bool has_room_for(std::uint32_t robot, std::uint32_t epoch) const noexcept;

  /// True iff the two contradict each other and the contribution's robot signed both. Two hashes
  /// and at most two checks of signatures.
  [[nodiscard]] static bool is_proof(const Signatures& signatures, std::uint32_t configuration,
                                     const ConflictBody& conflict, ProofCheck& check) noexcept;
  /// Keeps a proof that is valid. due: when it is passed on. False iff one of its epoch is known,
  /// or there is no place: then the first ones against its robot stay.
  bool add(const ConflictBody& conflict, Instant due) noexcept;
  /// The same, and counts it.
  void note(const ConflictBody& conflict, Instant due, ExchangeReport& counted) noexcept;
  /// True iff one more proof of another robot may be checked now.
  [[nodiscard]] bool may_check(Instant now) noexcept { return checks_.pass(kChecksPerSecond, now); }
  /// Somebody lacks this proof: it is sent at that time, or later if it was sent lately.
  static void owe(Known& known, Instant at, Duration pause) noexcept;
  /// Writes a proof that is due. False: none is.
  [[nodiscard]] bool write_due(ByteWriter& to, Instant now) noexcept;

 private:
  std::span<Known> known_;
  std::size_t count_ = 0;
  RateLimit checks_{};
};

}  // namespace tessera
