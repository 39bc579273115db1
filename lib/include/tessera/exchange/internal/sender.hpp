// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is sent next, under a budget of bytes: frames, statements, announcements, requests,
// descriptions and chunks, each signed and tagged.
#pragma once

#include "tessera/exchange/internal/answers.hpp"
#include "tessera/exchange/internal/repair.hpp"

namespace tessera {

class Sender {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return Answers::required_bytes(config) + arena_bytes<Due>(config.contributions) +
           arena_bytes<Fresh>(config.fresh) + arena_bytes<Batch>(kBatches) +
           arena_bytes<HashTree>(1) + arena_bytes<Description>(1);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Sender> make(Arena& arena, const ExchangeConfig& config) noexcept;
  Sender() noexcept = default;

  /// As Exchange::send.
  [[nodiscard]] std::size_t send(Gate& gate, Ledger& ledger, Repair& repair, Instant now,
                                 std::span<std::byte> into, ExchangeReport& counted) noexcept;
  /// What was published and is to go out.
  void note_fresh(BlockKey key, VersionRange versions) noexcept;
  /// Another contribution of this robot's is published from now on.
  void begin_own(const Ledger& ledger) noexcept;
  void announce_soon() noexcept { announce_soon_ = true; }
  void leave() noexcept { leave_due_ = true; }
  /// A frame or statement is to be sent, by others than its origin only if nobody else does.
  void owe_frame(const Ledger& ledger, const Ledger::Contribution& contribution,
                 Instant at) noexcept;
  void owe_statement(const Ledger& ledger, const Ledger::Contribution& contribution,
                     Instant at) noexcept;
  /// Another robot has sent it.
  void drop_frame(const Ledger& ledger, const Ledger::Contribution& contribution) noexcept;
  void drop_statement(const Ledger& ledger, const Ledger::Contribution& contribution) noexcept;
  [[nodiscard]] Answers& answers() noexcept { return answers_; }
  [[nodiscard]] const Answers& answers() const noexcept { return answers_; }

 private:
  /// Of a contribution, by its place: when what is owed is due, and was sent last.
  struct Due {
    std::uint32_t generation = 0;
    Instant frame = Instant::never();
    Instant statement = Instant::never();
    Instant frame_sent;
    Instant statement_sent;
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
    std::uint32_t generation = 0;
    std::uint32_t asker = 0;
    VersionRange range;  ///< Of which these are all; what is left of it.
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
  /// Where a robot publishes few versions far apart, one bucket of the index has all of its
  /// records, and each answer is a walk over all. Beyond kFreeWalk records an answer, so many are
  /// looked at in a second for each robot (Peer::kMostWalk at once).
  static constexpr std::size_t kFreeWalk = 256;
  static constexpr std::int64_t kWalkPerSecond = 200'000;
  /// Records that are looked at for what is not there, in a datagram.
  static constexpr std::size_t kMostInVain = 4096;
  /// What to look for what is not there costs at least.
  static constexpr std::size_t kLeastInVain = 16;

  /// What one datagram is made with.
  struct Making {
    Gate& gate;
    Ledger& ledger;
    Repair& repair;
    Instant now;
    ExchangeReport& counted;
    DatagramKind kind = DatagramKind::kAnnounce;
    std::uint32_t asker = 0;
    bool for_asker = false;
  };

  [[nodiscard]] Due& due_of(const Ledger& ledger,
                            const Ledger::Contribution& contribution) noexcept;
  void earn(Instant now) noexcept;
  [[nodiscard]] bool write_body(Making& make, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_announcement(Making& make, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_due_frame(Making& make, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_due_statement(Making& make, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_due_conflict(Making& make, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_descriptions(Making& make, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_chunk(Making& make, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_picks(Making& make, ByteWriter& to) noexcept;
  void write_batch(Making& make, ByteWriter& to, Batch& batch) noexcept;
  [[nodiscard]] bool write_record(Making& make, RecordWriter& writer,
                                  const Ledger::Contribution& contribution,
                                  const Replicas::Replica& part) noexcept;
  void finish_chunk(Making& make, ByteWriter& again, ChunkHeader& header,
                    const Ledger::Contribution& contribution) noexcept;
  void sign_root(Making& make, const ContributionId& id) noexcept;
  [[nodiscard]] std::size_t append_signature(Making& make, std::span<std::byte> into,
                                             std::size_t size) noexcept;
  /// Returns how many records it looked at.
  static std::size_t collect(const Ledger& ledger, Batch& batch) noexcept;
  /// True if a robot may be answered: it has bytes and records to look at left. Refused ones are
  /// counted.
  [[nodiscard]] bool may_answer(Making& make, std::uint32_t asker) noexcept;
  static void note_walk(Making& make, std::uint32_t asker, std::size_t visited,
                        bool found = true) noexcept;
  void collect_fresh(const Ledger& ledger, Batch& batch) noexcept;
  [[nodiscard]] bool next_fresh(Making& make) noexcept;
  [[nodiscard]] bool next_answer(Making& make) noexcept;

  std::uint32_t robot_ = 0;
  std::uint64_t session_ = 0;
  std::uint32_t mission_ = 0;
  std::int64_t bytes_per_s_ = 0;
  std::int64_t burst_bytes_ = 0;
  Duration announce_{};
  Duration announce_soon_time_{};
  Duration frame_pause_{};
  Answers answers_{};
  std::span<Due> dues_;
  std::span<Batch> batches_;  ///< Of what is new, and of an answer.
  std::span<Fresh> fresh_;    ///< A ring, in the order of versions, up to the latest.
  std::size_t fresh_first_ = 0;
  std::size_t fresh_count_ = 0;
  std::uint32_t sent_ =
      0;  ///< Versions of the own contribution that went out, or are in the batch.
  std::uint32_t turn_ = 0;            ///< See write_chunk.
  std::uint32_t announced_next_ = 0;  ///< The place that the next announcement begins with.
  Instant announce_due_ = Instant::long_ago();
  bool announce_soon_ = false;
  bool leave_due_ = false;
  std::uint64_t control_sequence_ = 0;  ///< Of what a window is kept of.
  std::uint64_t data_sequence_ = 0;
  std::int64_t budget_bytes_ = 0;
  Instant budget_at_;
  HashTree* tree_ = nullptr;  ///< Of the records of a chunk.
  Signature signature_{};     ///< Of the chunk, frame or statement that is sent.
  bool needs_signature_ = false;
  Description* description_ = nullptr;  ///< Scratch.
};

}  // namespace tessera
