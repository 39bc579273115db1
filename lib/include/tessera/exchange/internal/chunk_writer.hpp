// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Evidence that is sent: chunks of new records, chunks of records that others wait for, and
// descriptions, in turns.
#pragma once

#include "tessera/exchange/internal/answers.hpp"
#include "tessera/exchange/internal/outgoing.hpp"
#include "tessera/exchange/internal/record_batch.hpp"

namespace tessera {

class ChunkWriter {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return Answers::required_bytes(config) + FreshRecords::required_bytes(config.fresh) +
           arena_bytes<RecordBatch>(kBatches) + arena_bytes<Description>(1);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<ChunkWriter> make(Arena& arena,
                                                const ExchangeConfig& config) noexcept;
  ChunkWriter() noexcept = default;

  /// What was published and is to go out.
  void note_fresh(BlockKey key, VersionRange versions) noexcept { fresh_.note(key, versions); }
  /// Another contribution of this robot's is published from now on.
  void begin_own() noexcept;
  /// Writes a chunk or descriptions, if anything is to be sent.
  [[nodiscard]] bool write(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] Answers& answers() noexcept { return answers_; }
  [[nodiscard]] const Answers& answers() const noexcept { return answers_; }

 private:
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

  [[nodiscard]] bool write_descriptions(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_picks(Outgoing& out, ByteWriter& to) noexcept;
  static void write_batch(Outgoing& out, ByteWriter& to, RecordBatch& batch) noexcept;
  [[nodiscard]] static bool write_record(Outgoing& out, RecordWriter& writer,
                                         const Ledger::Contribution& contribution,
                                         const Replicas::Replica& part) noexcept;
  static void finish_chunk(Outgoing& out, ByteWriter& again, ChunkHeader& header,
                           const Ledger::Contribution& contribution) noexcept;
  /// True if a robot may be answered: it has bytes and records to look at left. Refused ones are
  /// counted.
  [[nodiscard]] bool may_answer(Outgoing& out, std::uint32_t asker) noexcept;
  static void note_walk(Outgoing& out, std::uint32_t asker, std::size_t visited,
                        bool found = true) noexcept;
  [[nodiscard]] bool next_fresh(Outgoing& out) noexcept;
  [[nodiscard]] bool next_answer(Outgoing& out) noexcept;

  Answers answers_{};
  std::span<RecordBatch> batches_;  ///< Of what is new, and of an answer.
  FreshRecords fresh_{};
  /// Versions of the own contribution that went out, or are in the batch.
  std::uint32_t sent_ = 0;
  std::uint32_t turn_ = 0;              ///< See write.
  Description* description_ = nullptr;  ///< Scratch.
};

}  // namespace tessera
