// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is held of every contribution, and what its origin states that there is. The outcome depends
// on the set of what arrived, not on its order. No network, and no time but for the pace of frames.
//
// Invariants:
// - held and records of a contribution are the fingerprint and number of its live records in the
//   store, and its index lists these records.
// - In a fleet that signs, statement and frame were signed by the contribution's robot, and so was
//   every record.
// - No contribution is held whose epoch is below its robot's floor, or is ended by a proof.
#pragma once

#include <optional>

#include "tessera/base/rigid_code.hpp"
#include "tessera/exchange/internal/chunk_taker.hpp"
#include "tessera/exchange/internal/epoch_floors.hpp"
#include "tessera/exchange/internal/gate.hpp"
#include "tessera/exchange/internal/record_maker.hpp"

namespace tessera {

class Ledger {
 public:
  using Contribution = HeldContribution;
  using Taken = ChunkTaker::Taken;

  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config,
                                                            int num_components) noexcept {
    return ContributionTable::required_bytes(config) + EpochFloors::required_bytes(config) +
           HeldRecords::required_bytes(config, num_components) + ChunkTaker::required_bytes() +
           Conflicts::required_bytes() + BlockContent::required_bytes(num_components) +
           RecordMaker::required_bytes();
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Ledger> make(Arena& arena, const ExchangeConfig& config,
                                           const ReplicaStore& store, const Gate& gate,
                                           int num_components) noexcept;
  Ledger() noexcept = default;

  // --- What this robot publishes -----------------------------------------------------------------

  /// As Exchange::open, move, publish and read_published.
  [[nodiscard]] Status open(std::uint32_t epoch, std::uint32_t submap,
                            const Matrix34d& T_global_map, ExchangeReport& counted) noexcept;
  [[nodiscard]] Status open_earlier(std::uint32_t submap, const Matrix34d& T_global_map,
                                    ExchangeReport& counted) noexcept;
  [[nodiscard]] Result<std::uint32_t> publish_earlier(std::uint32_t submap, BlockKey key,
                                                      const BlockContent& content,
                                                      ExchangeReport& counted) noexcept;
  /// As Exchange::object. Without a contribution of objections it opens one.
  [[nodiscard]] Result<std::uint32_t> object(const Objection& objection,
                                             ExchangeReport& counted) noexcept;
  /// The same of what is stated about frames, in its place. Fails as Exchange::state.
  [[nodiscard]] Result<std::uint32_t> state(BlockKey place, std::span<const std::byte> statement,
                                            ExchangeReport& counted) noexcept;
  [[nodiscard]] Status open_session(std::uint32_t submap, const MapSession& session,
                                    const Matrix34d& T_global_map,
                                    ExchangeReport& counted) noexcept;
  [[nodiscard]] Status end_session(std::uint32_t submap) noexcept;
  void set_session_floor(std::uint32_t floor, ExchangeReport& counted) noexcept;
  [[nodiscard]] Status move(std::uint32_t epoch, std::uint32_t submap,
                            const Matrix34d& T_global_map) noexcept;
  /// As Exchange::move_earlier. number: of a place.
  [[nodiscard]] bool move_earlier(std::uint32_t number, const RigidCode& code,
                                  const Matrix34d& T_global_map) noexcept;
  /// An earlier epoch of this robot has that place.
  [[nodiscard]] bool is_earlier(std::uint32_t number) const noexcept;
  /// published: gets the versions that were given, of at most four parts; at least their number.
  [[nodiscard]] Result<std::uint32_t> publish(BlockKey key, const BlockContent& content,
                                              VersionRange& published,
                                              ExchangeReport& counted) noexcept;
  [[nodiscard]] bool read_published(BlockKey key, BlockContent& content) const noexcept;
  /// What this robot's contribution holds now.
  [[nodiscard]] Statement statement_of(const Contribution& own, VersionRange range) const noexcept;

  // --- What arrives ------------------------------------------------------------------------------

  /// The place of a contribution whose name was heard, or null. Names take free places alone.
  [[nodiscard]] Contribution* note_name(const ContributionId& id, Instant now,
                                        ExchangeReport& counted) noexcept;
  /// True iff one without a place would get that of another of its robot by its frame.
  [[nodiscard]] bool would_displace(const ContributionId& id) noexcept {
    return id.epoch >= floors_.of(id) && !is_ended(id) && table_.would_displace(id);
  }
  /// Takes the records of a chunk. contribution: open, not this robot's. awaited: count held ones.
  [[nodiscard]] Taken take_chunk(Contribution& contribution, const ChunkHeader& header,
                                 std::span<const std::byte> body, bool awaited,
                                 ExchangeReport& counted) noexcept;
  /// Of a chunk of its own that another robot sent: Taken::held; nothing if it holds false ones.
  [[nodiscard]] std::optional<std::uint32_t> check_own_chunk(const Contribution& own,
                                                             const ChunkHeader& header,
                                                             std::span<const std::byte> body,
                                                             bool awaited) noexcept;
  /// Takes a statement that its origin signed, with its proof. is_last: it came from the
  /// contribution's robot, and is the last that did: without signatures it replaces any other.
  /// False: it is forged.
  [[nodiscard]] bool take_statement(const Statement& statement, std::span<const std::byte> proof,
                                    bool is_last, Instant now, ExchangeReport& counted) noexcept;
  /// Takes the statement of a chunk that was taken: its signature was checked with that.
  void take_chunk_statement(Contribution& contribution, const Statement& statement, bool is_last,
                            ExchangeReport& counted) noexcept;
  /// True iff a map can be there.
  [[nodiscard]] bool is_valid(const FrameBody& frame) const noexcept {
    return GridTransform::make(frame.T_global_map, resolution_m_).ok();
  }
  /// Takes a valid frame, with its proof. is_last: it came from the contribution's robot, and is
  /// the last that did: without signatures it replaces any other. False: it is forged.
  [[nodiscard]] bool take_frame(const FrameBody& frame, std::span<const std::byte> proof,
                                bool is_last, Instant now, ExchangeReport& counted) noexcept;
  /// What a robot says of its own epochs. may_fall: it may also be lower than before.
  void note_floor(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                  ExchangeReport& counted) noexcept;
  /// The same of its sessions.
  void note_session_floor(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                          ExchangeReport& counted) noexcept;
  /// As EpochFloors::note_claim.
  void note_floor_claim(std::uint32_t floor, Instant now) noexcept {
    floors_.note_claim(floor, table_.publishing(), now);
  }
  /// Without signatures: a robot that publishes in this epoch, and announced all that it has of
  /// its own. What it left out twice of this epoch or later ones, somebody else made up.
  /// O(contributions).
  void drop_unlisted(std::uint32_t robot, std::uint32_t epoch, Instant now,
                     ExchangeReport& counted) noexcept;
  /// Takes what may be the proof of a conflict. False: it is none.
  [[nodiscard]] bool take_conflict(const ConflictBody& conflict, ExchangeReport& counted) noexcept;
  /// Ends what proofs of conflicts end, by the fleet's policy. O(proofs contributions).
  void end_disputed(ExchangeReport& counted) noexcept;
  /// Frees places of names for which nothing came. O(contributions).
  void drop_empty_names(Instant now) noexcept { table_.drop_empty_names(now); }
  /// Takes all of a robot out.
  void remove_robot(std::uint32_t robot) noexcept {
    table_.drop_named_if([robot](const ContributionId& id) { return id.robot == robot; });
  }
  /// Ends what this process published: a new epoch is at the floor or above.
  void end_own(std::uint32_t floor, ExchangeReport& counted) noexcept;

  // --- What is there -----------------------------------------------------------------------------

  [[nodiscard]] Contribution* find(const ContributionId& id) noexcept { return table_.find(id); }
  [[nodiscard]] ContributionTable& table() noexcept { return table_; }
  [[nodiscard]] const ContributionTable& table() const noexcept { return table_; }
  [[nodiscard]] FarContributions& far() noexcept { return table_.far(); }
  [[nodiscard]] const FarContributions& far() const noexcept { return table_.far(); }
  /// As it is sent to others.
  [[nodiscard]] FrameBody frame_of(const Contribution& contribution) const noexcept;
  [[nodiscard]] std::span<Contribution> places() noexcept { return table_.places(); }
  [[nodiscard]] Contribution& place(std::uint32_t number) noexcept { return table_.place(number); }
  [[nodiscard]] const Contribution& place(std::uint32_t number) const noexcept {
    return table_.place(number);
  }
  [[nodiscard]] std::span<const Contribution> places() const noexcept { return table_.places(); }
  /// As ContributionTable::lacks_nothing.
  [[nodiscard]] bool lacks_nothing(const Contribution& contribution) const noexcept {
    return table_.lacks_nothing(contribution);
  }
  [[nodiscard]] std::uint32_t number_of(const Contribution& contribution) const noexcept {
    return table_.number_of(contribution);
  }
  /// The contribution that publish() is of, or null.
  [[nodiscard]] const Contribution* publishing() const noexcept { return table_.publishing(); }
  /// True if only this process publishes this contribution.
  [[nodiscard]] bool is_of_this_process(const ContributionId& id) const noexcept {
    return floors_.is_of_this_process(id);
  }
  /// Bytes of records that are held, codes and proofs.
  [[nodiscard]] std::uint64_t held_bytes() const noexcept { return table_.held_bytes(); }
  /// As ContributionTable::digest.
  [[nodiscard]] std::uint64_t digest() const noexcept { return table_.digest(); }
  [[nodiscard]] const EpochFloors& floors() const noexcept { return floors_; }
  [[nodiscard]] HeldRecords& records() noexcept { return records_; }
  [[nodiscard]] const HeldRecords& records() const noexcept { return records_; }
  [[nodiscard]] const Replicas& replicas() const noexcept { return records_.replicas(); }
  [[nodiscard]] Conflicts& conflicts() noexcept { return conflicts_; }
  [[nodiscard]] const Conflicts& conflicts() const noexcept { return conflicts_; }

 private:
  [[nodiscard]] Result<Contribution*> open_own(const ContributionId& id,
                                               const Matrix34d& T_global_map,
                                               const MapSession& session,
                                               ExchangeReport& counted) noexcept;
  [[nodiscard]] Result<Contribution*> open_once(std::uint32_t submap,
                                                ExchangeReport& counted) noexcept;
  /// By the policy alarm nothing ends.
  [[nodiscard]] bool is_ended(const ContributionId& id) noexcept {
    return policy_ == ConflictPolicy::kExclude && conflicts_.find(id.robot, id.epoch) != nullptr;
  }
  void drop_below(std::uint32_t robot, std::uint32_t floor, ExchangeReport& counted) noexcept;
  void drop_sessions_below(std::uint32_t robot, std::uint32_t floor,
                           ExchangeReport& counted) noexcept;
  void keep_statement(Contribution& contribution, const Statement& statement, bool replaces,
                      std::span<const std::byte> proof, ExchangeReport& counted) noexcept;
  void note_conflict(const Statement& before, std::span<const std::byte> proof_before,
                     const Statement& statement, std::span<const std::byte> proof,
                     ExchangeReport& counted) noexcept;
  [[nodiscard]] bool take_far_statement(FarContribution& far, const Statement& statement,
                                        std::span<const std::byte> proof, bool is_last,
                                        ExchangeReport& counted) noexcept;
  [[nodiscard]] bool take_far_frame(FarContribution& far, const FrameBody& frame,
                                    std::span<const std::byte> proof, bool is_last, Instant now,
                                    ExchangeReport& counted) noexcept;
  [[nodiscard]] bool is_signed(const FrameBody& frame, std::span<const std::byte> proof) noexcept;

  std::uint32_t robot_ = 0;
  std::uint64_t session_ = 0;
  double resolution_m_ = 0.0;
  Duration frame_pause_{};
  ConflictPolicy policy_ = ConflictPolicy::kAlarm;
  Signatures signatures_{};
  std::uint32_t configuration_ = 0;
  ContributionTable table_{};
  EpochFloors floors_{};
  HeldRecords records_{};
  ChunkTaker chunks_{};
  RecordMaker maker_{};
  Conflicts conflicts_{};
  BlockContent content_{};  ///< Scratch.
};

}  // namespace tessera
