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

#include "tessera/exchange/conflicts.hpp"
#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/exchange/internal/coverage.hpp"
#include "tessera/exchange/internal/gate.hpp"
#include "tessera/exchange/internal/version_index.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

class Ledger {
 public:
  using Slot = Replicas::Slot;

  /// What is held of one contribution, and what is known of it.
  struct Contribution {
    ContributionId id;
    bool used = false;    ///< The place is taken.
    bool own = false;     ///< Started by open(): nobody else has more of it.
    bool open = false;    ///< There is a frame, hence a slot.
    bool stated = false;  ///< There is a statement.
    bool full = false;    ///< What came last was refused for lack of room.
    std::uint8_t proof_bytes = 0;
    Slot slot = 0;
    std::uint32_t generation = 0;  ///< Of the place: higher with each contribution that has it.
    std::uint32_t latest = 0;      ///< The highest version that was heard of.
    std::uint32_t frame_revision = 0;
    /// The revision to ask for: one more than is held if somebody says that there is a later one.
    /// A hint, as coverage is.
    std::uint32_t announced_frame = 0;
    std::uint32_t records = 0;
    std::uint64_t record_bytes = 0;  ///< Codes and proofs of these records.
    Fingerprint held{};
    Statement statement{};
    std::array<std::byte, kMostProofBytes> proof{};  ///< Of the statement.
    Matrix34d T_global_map = Matrix34d::Identity();
    Signature frame_signature{};
    Instant frame_at;   ///< When the revision was taken.
    Instant since;      ///< When its name was first heard.
    Instant origin_at;  ///< When the process that publishes it was last heard of it.
    Instant listed;     ///< When its robot last announced it.
    Instant denied;     ///< When its robot first left it out, since it last announced it.
    /// Versions that need not be asked for: it has them, or a robot that sent others of the range
    /// said that there are no more. A hint: nothing is complete by it.
    Coverage coverage;
    VersionIndex index;

    /// What is held is what its origin stated last.
    [[nodiscard]] bool complete() const noexcept {
      return own || (open && stated && records == statement.records &&
                     held == statement.fingerprint && frame_revision >= statement.frame_revision);
    }
  };

  /// What a chunk did.
  struct Taken {
    bool well_formed = true;
    bool grew = false;          ///< Something was new, if only that there is no more.
    std::uint32_t records = 0;  ///< That were new.
    std::uint32_t held = 0;     ///< That are the latest of their blocks here now.
    bool refused = false;       ///< There was no room for some.
    bool forged = false;        ///< Its origin did not sign what it says.
  };

  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config,
                                                            int num_components) noexcept {
    return arena_bytes<Contribution>(config.contributions) +
           arena_bytes<RecordLink>(config.records) + arena_bytes<RobotFloor>(config.peers + 1) +
           BlockContent::required_bytes(num_components) +
           arena_bytes<std::byte>(most_packed_bytes(num_components)) +
           arena_bytes<std::byte>(kMostCoded) + arena_bytes<std::byte>(kMostKept) +
           arena_bytes<HashTree>(1) + Conflicts::required_bytes();
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
  [[nodiscard]] Status move(std::uint32_t epoch, std::uint32_t submap,
                            const Matrix34d& T_global_map) noexcept;
  /// published: gets the versions that were given, of at most four parts; at least their number.
  [[nodiscard]] Result<std::uint32_t> publish(BlockKey key, const BlockContent& content,
                                              VersionRange& published,
                                              ExchangeReport& counted) noexcept;
  [[nodiscard]] bool read_published(BlockKey key, BlockContent& content) const noexcept;
  /// What this robot's contribution holds now.
  [[nodiscard]] Statement statement_of(const Contribution& own, VersionRange range) const noexcept;
  /// The contribution that publish() is of, or null.
  [[nodiscard]] const Contribution* publishing() const noexcept {
    return publishing_ == kNobody ? nullptr : &contributions_[publishing_];
  }

  // --- What arrives ------------------------------------------------------------------------------

  /// The place of a contribution whose name was heard, or null. Names take free places alone.
  [[nodiscard]] Contribution* note_name(const ContributionId& id, Instant now,
                                        ExchangeReport& counted) noexcept;
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
  /// Takes a frame. is_last: it came from the contribution's robot, and is the last that did:
  /// without signatures it replaces any other. False: it is none, or forged.
  [[nodiscard]] bool take_frame(const FrameBody& frame, std::span<const std::byte> signature,
                                bool is_last, Instant now, ExchangeReport& counted) noexcept;
  /// What a robot says of its own epochs. may_fall: it may also be lower than before.
  void note_floor(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                  ExchangeReport& counted) noexcept;
  /// Another robot knows of a floor of this one that is above its epoch: the counter of its epochs
  /// was lost.
  void note_floor_claim(std::uint32_t floor) noexcept;
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
  void drop_empty_names(Instant now) noexcept;
  /// Takes all of a robot out.
  void remove_robot(std::uint32_t robot) noexcept;

  // --- What is there -----------------------------------------------------------------------------

  [[nodiscard]] Contribution* find(const ContributionId& id) noexcept;
  [[nodiscard]] std::span<Contribution> places() noexcept { return contributions_; }
  [[nodiscard]] std::span<const Contribution> places() const noexcept { return contributions_; }
  [[nodiscard]] Conflicts& conflicts() noexcept { return conflicts_; }
  [[nodiscard]] const Conflicts& conflicts() const noexcept { return conflicts_; }
  [[nodiscard]] std::uint32_t number_of(const Contribution& contribution) const noexcept {
    return static_cast<std::uint32_t>(&contribution - contributions_.data());
  }
  /// True if only this process publishes this contribution.
  [[nodiscard]] bool is_of_this_process(const ContributionId& id) const noexcept {
    return id.robot == robot_ && id.epoch >= first_epoch_;
  }
  [[nodiscard]] std::uint32_t own_floor() const noexcept { return own_floor_; }
  [[nodiscard]] std::uint32_t floor_of(std::uint32_t robot) const noexcept;
  [[nodiscard]] std::span<const RobotFloor> floors() const noexcept {
    return std::span<const RobotFloor>(floors_).first(floor_count_);
  }
  /// The epoch that was heard in this robot's name and is not this process's, if there is one: a
  /// new epoch must be above it.
  [[nodiscard]] std::optional<std::uint32_t> overtaken() const noexcept { return overtaken_; }
  [[nodiscard]] std::uint64_t highest_session() const noexcept { return highest_session_; }
  /// Ends what this process published: a new epoch is above it.
  void end_own(std::uint32_t floor, ExchangeReport& counted) noexcept;

  /// The record with its code, and its proof if it has one. part: live. Into a scratch that lasts
  /// until the next call.
  [[nodiscard]] ChunkRecord record_of(const Replicas::Replica& part) noexcept;
  [[nodiscard]] const Replicas& replicas() const noexcept { return *store_.replicas; }
  [[nodiscard]] std::span<const RecordLink> links() const noexcept { return links_; }
  /// Of the records with a version the one at this place, or null, and how many there are: more
  /// than one only of who publishes a version twice. O(records in its bucket), which are visited.
  struct OfVersion {
    const Replicas::Replica* part = nullptr;
    std::uint32_t count = 0;
    std::size_t visited = 0;
  };
  [[nodiscard]] OfVersion find_version(const Contribution& contribution, std::uint32_t version,
                                       std::uint32_t place) const noexcept;
  /// True if there are at most held records of a range; false also where that is a long walk.
  [[nodiscard]] bool is_all_of(const Contribution& contribution, const VersionRange& range,
                               std::uint32_t held) const noexcept;
  /// Bytes of records that were taken, codes and proofs, since the start.
  [[nodiscard]] std::uint64_t taken_bytes() const noexcept { return taken_bytes_; }
  /// The same of those that are held.
  [[nodiscard]] std::uint64_t held_bytes() const noexcept { return held_bytes_; }
  /// Fingerprint::folded() over all contributions with their frames. O(contributions).
  [[nodiscard]] std::uint64_t digest() const noexcept;

 private:
  static constexpr std::size_t kMostCoded = most_coded_bytes(kBlockLayers);
  static constexpr std::size_t kMostKept = 1 + kMostProofBytes + kMostCodedBytes;
  static constexpr std::uint32_t kNobody = ~std::uint32_t{0};

  /// Who wants a place: nothing but a name, a frame, a frame that its robot itself sent, or open().
  enum class Claim : std::uint8_t { kName, kFrame, kPresent, kOwn };
  [[nodiscard]] Contribution* add(const ContributionId& id, Claim claim, Instant now,
                                  ExchangeReport& counted) noexcept;
  [[nodiscard]] Contribution* free_place(bool own) noexcept;
  [[nodiscard]] Contribution* place_of_silent(Instant now) noexcept;
  [[nodiscard]] bool is_ended(const ContributionId& id) noexcept;
  void note_conflict(const Contribution& contribution, const ChunkRecord& record,
                     const Replicas::Replica& other, ExchangeReport& counted) noexcept;
  void note_conflict(const Contribution& contribution, const Statement& statement,
                     std::span<const std::byte> proof, ExchangeReport& counted) noexcept;
  bool add_conflict(const ConflictBody& conflict, Instant due, ExchangeReport& counted) noexcept;
  [[nodiscard]] Contribution* displaced_of_robot(const ContributionId& id, bool proven,
                                                 bool& refused) noexcept;
  void drop(Contribution& contribution) noexcept;
  void drop_below(std::uint32_t robot, std::uint32_t floor, ExchangeReport& counted) noexcept;
  [[nodiscard]] RobotFloor* floor_place(std::uint32_t robot) noexcept;
  [[nodiscard]] bool may_rise_to(std::uint32_t epoch) const noexcept;
  bool note_overtaken(const Statement& statement) noexcept;
  void keep_statement(Contribution& contribution, const Statement& statement, bool replaces,
                      std::span<const std::byte> proof, ExchangeReport& counted) noexcept;
  [[nodiscard]] Status set_frame(Contribution& contribution, const Matrix34d& T_global_map,
                                 std::uint32_t revision) const noexcept;
  [[nodiscard]] Result<Replicas::Change> put(Contribution& contribution, BlockKey key,
                                             const PartVersion& version,
                                             const BlockContent& content,
                                             std::span<const std::byte> coded) noexcept;
  void list_block(Contribution& contribution, BlockKey key, bool add) noexcept;
  [[nodiscard]] std::uint32_t count_held(const Contribution& contribution,
                                         const ChunkHeader& header,
                                         std::span<const std::byte> records) noexcept;
  [[nodiscard]] const Replicas::Replica* contradicted(const Contribution& contribution,
                                                      BlockKey key,
                                                      const PartVersion& version) const noexcept;
  [[nodiscard]] const Replicas::Replica* of_other_block(const Contribution& contribution,
                                                        const PartVersion& version) const noexcept;
  [[nodiscard]] Status publish_parts(Contribution& contribution, BlockKey key,
                                     const BlockContent& content, unsigned parts,
                                     std::size_t whole_bytes, std::uint32_t& bytes,
                                     ExchangeReport& counted) noexcept;
  [[nodiscard]] Taken check_signed(const Contribution& contribution, const ChunkHeader& header,
                                   std::span<const std::byte> records, bool awaited) noexcept;
  [[nodiscard]] Taken take_records(Contribution& contribution, const ChunkHeader& header,
                                   std::span<const std::byte> records,
                                   ExchangeReport& counted) noexcept;
  enum class Fate : std::uint8_t { kTaken, kStale, kNoRoom, kMalformed, kForged };
  [[nodiscard]] Fate take_record(Contribution& contribution, const ChunkHeader& header,
                                 std::uint32_t leaf_number, ChunkRecord& record,
                                 ExchangeReport& counted) noexcept;
  [[nodiscard]] std::span<const std::byte> to_keep(std::span<const std::byte> coded,
                                                   std::span<const std::byte> proof) const noexcept;

  std::uint32_t robot_ = 0;
  std::uint64_t session_ = 0;
  double resolution_m_ = 0.0;
  std::uint32_t per_robot_ = 0;
  std::uint32_t own_places_ = 0;
  Duration frame_pause_{};
  ReplicaStore store_{};
  Signatures signatures_{};
  std::uint32_t configuration_ = 0;
  int num_components_ = 0;
  std::span<Contribution> contributions_;
  std::span<RecordLink> links_;
  std::span<RobotFloor> floors_;
  std::size_t floor_count_ = 0;
  std::uint32_t publishing_ = kNobody;
  std::uint32_t opened_ = 0;
  std::uint32_t first_epoch_ = ~std::uint32_t{0};  ///< The lowest that open() was called with.
  std::uint32_t own_floor_ = 0;
  std::optional<std::uint32_t> overtaken_;  ///< Until an epoch above it is opened.
  std::uint32_t floor_claims_ = 0;
  std::uint64_t highest_session_ = 0;  ///< Heard in this robot's name.
  std::uint64_t taken_bytes_ = 0;
  std::uint64_t held_bytes_ = 0;
  BlockContent content_{};
  std::span<std::byte> packed_;  ///< Scratch for a packed block.
  std::span<std::byte> coded_;   ///< Scratch for a block's code.
  std::span<std::byte> kept_;    ///< Scratch for what is kept of a record as it came.
  HashTree* tree_ = nullptr;     ///< Of the records of a chunk.
  Signature signature_{};        ///< Of the chunk at hand.
  ProofCheck proof_check_{};
  ConflictPolicy policy_ = ConflictPolicy::kAlarm;
  Conflicts conflicts_{};
};

}  // namespace tessera
