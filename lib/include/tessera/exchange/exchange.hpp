// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How robots come to have the same replicas over a network that loses, repeats, reorders and cuts:
// a state machine between datagrams and replicas, without sockets, clock or threads. Every version
// has a number of its own within its contribution, and a chunk says of which range of numbers it
// has all that still counts. So what a robot lacks is what its ranges leave out, anybody who has it
// can give it, and all that is ever exchanged may be heard in any order, often, or not at all
// (docs/exchange.md).
#pragma once

#include <span>

#include "tessera/exchange/block_codec.hpp"
#include "tessera/exchange/coverage.hpp"
#include "tessera/exchange/exchange_config.hpp"
#include "tessera/exchange/peer_table.hpp"
#include "tessera/exchange/publication.hpp"
#include "tessera/exchange/record_proof.hpp"
#include "tessera/exchange/wire.hpp"
#include "tessera/map/packed_block.hpp"

namespace tessera {

class Exchange {
 public:
  using Slot = Replicas::Slot;

  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config,
                                                            int num_components) noexcept {
    return arena_bytes<Contribution>(config.contributions) + arena_bytes<Answer>(config.answers) +
           arena_bytes<Fresh>(config.fresh) + PeerTable::required_bytes(config.peers) +
           arena_bytes<Batch>(kBatches) + BlockContent::required_bytes(num_components) +
           arena_bytes<std::byte>(most_packed_bytes(num_components)) +
           arena_bytes<std::byte>(kMostCoded) + arena_bytes<std::byte>(kMostKept);
  }
  /// Fails with kInvalidArgument iff a setting is out of its range; kResourceExhausted iff the
  /// arena is too small. What store, authenticator and signatures name must outlive it. With
  /// signatures nothing is taken that its origin did not sign, and a fleet has all of them or none.
  [[nodiscard]] static Result<Exchange> make(Arena& arena, const ExchangeConfig& config,
                                             const ReplicaStore& store,
                                             const Authenticator& authenticator,
                                             const ClassTable& classes,
                                             const Signatures& signatures = {}) noexcept;
  /// Of no use before one that was made is moved here.
  Exchange() noexcept = default;

  // --- What this robot says ----------------------------------------------------------------------

  /// Starts a contribution of this robot's: what publish() is of from now on. The first one before
  /// anything is received: from then on nobody else says anything of that epoch. Fails with
  /// kInvalidArgument iff T_global_map is no frame (GridTransform::make) or there is such a
  /// contribution, as after a restart with an epoch that was there before; kResourceExhausted iff
  /// there is no place for it.
  [[nodiscard]] Status open(std::uint32_t epoch, std::uint32_t submap,
                            const Matrix34d& T_global_map) noexcept;
  /// Moves a contribution that open() started. Fails with kInvalidArgument iff there
  /// is none or it is no frame.
  [[nodiscard]] Status move(std::uint32_t epoch, std::uint32_t submap,
                            const Matrix34d& T_global_map) noexcept;
  /// Publishes a block, quantised (block_codec.hpp), in as many parts as it takes: into this
  /// robot's own replicas, and to whom it may concern from the next send() on. Returns the bytes on
  /// the wire. Fails with kInvalidArgument iff no contribution was started; as ReplicaStore::put,
  /// and what was published before stays, as far as no part was taken. O(512 components).
  [[nodiscard]] Result<std::uint32_t> publish(BlockKey key, const BlockContent& content) noexcept;
  /// Adds what was last published of a block to content. False: nothing was, or an empty block.
  /// O(bytes).
  [[nodiscard]] bool read_published(BlockKey key, BlockContent& content) const noexcept;
  /// Tells the others, with the next send(), that this robot says no more.
  void leave() noexcept { leave_due_ = true; }
  /// Takes all of a robot out of the replicas, and hears it no more. Fails with kInvalidArgument
  /// iff it is this robot; kResourceExhausted iff kMostExcluded are excluded.
  [[nodiscard]] Status exclude(std::uint32_t robot) noexcept;

  // --- Datagrams ---------------------------------------------------------------------------------

  /// What arrived: any bytes at all. now_us: monotonic. Work: the tag's, and for each record that
  /// is news decoding and a put; for each request a walk over the coverage.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept;
  /// The next datagram to send to all, in into, of at least kMostDatagramBytes. Returns its size: 0
  /// iff nothing is due or the budget of bytes is used up; then ask again at the next tick. Work:
  /// at most a walk over the parts of two contributions.
  [[nodiscard]] std::size_t send(std::int64_t now_us, std::span<std::byte> into) noexcept;

  // --- How things stand --------------------------------------------------------------------------

  /// Counters never decrease. O(contributions).
  [[nodiscard]] ExchangeReport report() const noexcept;
  /// Of each contribution that report() counts, as far as into goes; returns how many there are.
  [[nodiscard]] std::size_t contributions(std::span<ContributionState> into) const noexcept;
  /// The one at this place of them. Fails with kOutOfRange iff there are not so many.
  [[nodiscard]] Result<ContributionState> contribution_at(std::size_t index) const noexcept;
  [[nodiscard]] const PeerTable& peers() const noexcept { return peers_; }
  /// Of all that is there: equal on robots that have the same versions of the same blocks in the
  /// same frames. O(contributions).
  [[nodiscard]] std::uint64_t digest() const noexcept;

 private:
  struct Contribution {
    ContributionId id;
    bool own = false;       ///< Started by open(): nobody else has more of it.
    bool open = false;      ///< There is a frame, hence a slot.
    bool excluded = false;  ///< Of a robot that is: nothing of it is taken.
    Slot slot = 0;
    std::uint32_t latest = 0;
    std::uint32_t announced_frame = 0;
    std::uint32_t frame_revision = 0;
    Matrix34d T_global_map = Matrix34d::Identity();
    Signature frame_signature{};
    std::uint64_t digest = 0;  ///< Sum over its parts.
    Coverage coverage;
    std::int64_t request_due_us = kNever;
    std::int64_t request_pause_us = 0;  ///< Until it is asked for again.
    std::uint32_t requests = 0;         ///< Since something came of one.
    std::int64_t origin_us = kLongAgo;  ///< When its origin was last heard of it.
    std::uint32_t origin_latest = 0;    ///< What it then said that there is.
    /// When one was heard who has another digest; long ago if the last one had the same.
    std::int64_t different_us = kLongAgo;
    bool full = false;            ///< What came last was refused for lack of room.
    std::int64_t all_due_us = 0;  ///< Not to be asked for as a whole before.
    std::int64_t all_pause_us = 0;
    std::int64_t frame_due_us = kNever;
    [[nodiscard]] bool complete() const noexcept {
      return open && coverage.complete_to() >= latest && frame_revision >= announced_frame;
    }
  };
  /// Versions that somebody asked for, and this robot has.
  struct Answer {
    std::uint32_t contribution = 0;
    VersionRange range;  ///< What is left of it.
    std::int64_t due_us = 0;
    bool all = false;  ///< Said though others say the same: they may have less.
  };
  /// Parts to send next, by version.
  struct Batch {
    static constexpr std::size_t kMostParts = 128;
    /// A record that waits to be sent.
    struct Part {
      std::uint32_t record = 0;
      std::uint32_t version = 0;
    };
    std::uint32_t contribution = 0;
    VersionRange range;  ///< Of which these are all; what is left of it.
    bool all = false;    ///< With those that only fill in for later versions.
    std::array<Part, kMostParts> parts{};
    std::size_t count = 0;
    std::size_t next = 0;
    [[nodiscard]] bool empty() const noexcept { return range.first > range.last; }
  };

  /// A part that was published.
  struct Fresh {
    BlockKey key{};
    std::uint32_t version = 0;
  };

  static constexpr std::size_t kBatches = 2;
  static constexpr std::size_t kMostCoded = most_coded_bytes(kBlockLayers);
  static constexpr std::size_t kMostKept = 1 + kMostProofBytes + kMostCodedBytes;
  static constexpr std::int64_t kNever = INT64_MAX;
  static constexpr std::int64_t kLongAgo = INT64_MIN / 2;
  /// Requests without an answer after which nobody is expected to have it.
  static constexpr std::uint32_t kPatience = 16;

  [[nodiscard]] static ContributionState state_of(const Contribution& contribution) noexcept;
  [[nodiscard]] std::int64_t random_us(std::int64_t below) noexcept;
  [[nodiscard]] Contribution* find(const ContributionId& id) noexcept;
  [[nodiscard]] Contribution* find_or_add(const ContributionId& id, bool own = false) noexcept;
  [[nodiscard]] std::uint32_t number_of(const Contribution& contribution) const noexcept {
    return static_cast<std::uint32_t>(&contribution - contributions_.data());
  }
  [[nodiscard]] bool is_excluded(std::uint32_t robot) const noexcept;
  [[nodiscard]] std::uint64_t digest_of(Slot slot, BlockKey key) const noexcept;
  [[nodiscard]] Result<Replicas::Change> put(Contribution& contribution, BlockKey key,
                                             const PartVersion& version,
                                             const BlockContent& content,
                                             std::span<const std::byte> coded) noexcept;
  [[nodiscard]] Status set_frame(Contribution& contribution, const Matrix34d& T_global_map,
                                 std::uint32_t revision) const noexcept;
  [[nodiscard]] Status publish_parts(Contribution& contribution, BlockKey key,
                                     const BlockContent& content, unsigned parts,
                                     std::size_t whole_bytes, std::uint32_t& bytes) noexcept;

  /// A datagram that was accepted.
  struct Heard {
    DatagramHeader header{};
    Peer* peer = nullptr;  ///< Of a chunk or frame there may be none.
    bool is_new = true;    ///< No repeat.
  };
  [[nodiscard]] bool accept(std::span<const std::byte> datagram, Heard& heard,
                            std::int64_t now_us) noexcept;
  [[nodiscard]] bool note_peer(Heard& heard, std::int64_t now_us) noexcept;
  [[nodiscard]] static bool is_last(const Heard& heard) noexcept;
  [[nodiscard]] bool hear(const Heard& heard, ByteReader& body, std::int64_t now_us) noexcept;
  [[nodiscard]] bool is_signed_by_sender(const DatagramHeader& header,
                                         std::span<const std::byte> message) const noexcept;
  [[nodiscard]] bool hear_announcement(const Heard& heard, ByteReader& body,
                                       std::int64_t now_us) noexcept;
  void note_latest(Contribution& contribution, const AnnouncedContribution& announced,
                   bool of_origin, std::int64_t now_us) const noexcept;
  void hear_announced(const AnnouncedContribution& announced, bool of_origin,
                      std::int64_t now_us) noexcept;
  [[nodiscard]] bool hear_request(ByteReader& body, std::int64_t now_us) noexcept;
  void hear_requested(const RequestedContribution& requested, std::int64_t now_us) noexcept;
  [[nodiscard]] bool hear_chunk(ByteReader& body, bool is_new, std::int64_t now_us) noexcept;
  struct Taken {
    bool well_formed = true;
    bool grew = false;     ///< The coverage did.
    bool refused = false;  ///< There was no room for some.
    bool forged = false;   ///< Its origin did not sign what is said.
  };
  [[nodiscard]] Taken take_chunk(Contribution& contribution, const ChunkHeader& header,
                                 ByteReader& body) noexcept;
  [[nodiscard]] Taken check_chunk(const Contribution& contribution, const ChunkHeader& header,
                                  ByteReader records) noexcept;
  [[nodiscard]] Taken take_records(Contribution& contribution, const ChunkHeader& header,
                                   ByteReader records) noexcept;
  [[nodiscard]] std::span<const std::byte> to_keep(std::span<const std::byte> coded,
                                                   std::span<const std::byte> proof) const noexcept;
  [[nodiscard]] bool hear_frame(ByteReader& body, bool is_new) noexcept;
  void note_lack(Contribution& contribution, std::int64_t now_us) noexcept;
  void note_digest(Contribution& contribution, const AnnouncedContribution& announced,
                   bool of_origin, std::int64_t now_us) noexcept;
  [[nodiscard]] bool is_own_to_come(const ContributionId& id) noexcept;
  [[nodiscard]] bool add_answer(const Answer& wanted) noexcept;
  void answer_with_all(const Contribution& contribution, std::int64_t due_us) noexcept;
  void drop_answers(std::uint32_t contribution, VersionRange heard, bool all) noexcept;

  [[nodiscard]] bool write_body(DatagramKind& kind, ByteWriter& to, std::int64_t now_us) noexcept;
  [[nodiscard]] bool write_announcement(ByteWriter& to, std::int64_t now_us) noexcept;
  [[nodiscard]] bool write_due_frame(ByteWriter& to, std::int64_t now_us) noexcept;
  [[nodiscard]] bool write_request(ByteWriter& to, std::int64_t now_us) noexcept;
  [[nodiscard]] bool write_chunk(ByteWriter& to, std::int64_t now_us) noexcept;
  void write_batch(ByteWriter& to, Batch& batch) noexcept;
  [[nodiscard]] std::size_t sign(DatagramKind kind, std::span<std::byte> into,
                                 std::size_t size) noexcept;
  void collect(Batch& batch) noexcept;
  void note_fresh(BlockKey key, std::uint32_t version) noexcept;
  void collect_fresh(Batch& batch) noexcept;
  [[nodiscard]] bool next_fresh() noexcept;
  [[nodiscard]] bool next_answer(std::int64_t now_us) noexcept;

  ExchangeConfig config_{};
  ReplicaStore store_{};
  Authenticator authenticator_{};
  Signatures signatures_{};
  ConfigurationDetails details_{};
  std::uint32_t configuration_ = 0;
  int num_components_ = 0;
  std::span<Contribution> contributions_;
  std::uint32_t known_ = 0;
  std::span<Answer> answers_;
  std::size_t waiting_answers_ = 0;
  PeerTable peers_{};
  std::array<std::uint32_t, ExchangeConfig::kMostExcluded> excluded_{};
  std::size_t excluded_count_ = 0;
  std::span<Batch> batches_;                       ///< Of what is new, and of an answer.
  std::uint32_t publishing_ = kNobody;             ///< The contribution that publish() is of.
  std::uint32_t opened_ = 0;                       ///< Times that open() succeeded.
  std::uint32_t first_epoch_ = ~std::uint32_t{0};  ///< The lowest that open() was called with.
  std::uint32_t sent_ = 0;  ///< Of it, versions that went out or are in the batch.
  std::span<Fresh> fresh_;  ///< A ring, in the order of versions, up to the latest.
  std::size_t fresh_first_ = 0;
  std::size_t fresh_count_ = 0;
  bool answer_next_ = false;          ///< New blocks and answers take turns.
  bool answered_ = false;             ///< The last chunk was an answer.
  std::uint32_t announced_next_ = 0;  ///< The contribution that the next announcement begins with.
  std::int64_t announce_due_us_ = 0;
  bool announce_soon_ = false;
  bool leave_due_ = false;
  std::uint32_t control_sequence_ = 0;  ///< Of what a window is kept of.
  std::uint32_t data_sequence_ = 0;
  std::uint64_t random_ = 0;
  std::int64_t budget_bytes_ = 0;
  std::int64_t budget_us_ = 0;
  bool started_ = false;
  BlockContent content_{};
  std::span<std::byte> packed_;  ///< Scratch for a packed block.
  std::span<std::byte> coded_;   ///< Scratch for a block's code.
  std::span<std::byte> kept_;    ///< Scratch for what is kept of a record as it came.
  HashTree tree_{};              ///< Of the records of a chunk.
  Signature signature_{};        ///< Of the chunk or frame that is received or sent.
  bool proofs_ = false;          ///< The chunk that is sent has them, and no signature.
  ProofCheck proof_check_{};
  ExchangeReport counted_{};

  static constexpr std::uint32_t kNobody = ~std::uint32_t{0};
};

/// What a Publisher publishes into. Of a block with labels, 1/14 of a byte is taken for each voxel
/// that is only free, and the rest for its labels. exchange must outlive it.
[[nodiscard]] Publication publication_of(Exchange& exchange) noexcept;

}  // namespace tessera
