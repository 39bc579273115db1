// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is sent next, under a budget of bytes: where the robot is, control messages, requests and
// chunks, each signed and tagged.
#pragma once

#include "tessera/exchange/internal/chunk_writer.hpp"
#include "tessera/exchange/internal/control_writer.hpp"
#include "tessera/exchange/internal/presence_sender.hpp"

namespace tessera {

class Sender {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return ControlWriter::required_bytes(config) + ChunkWriter::required_bytes(config) +
           arena_bytes<HashTree>(1);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Sender> make(Arena& arena, const ExchangeConfig& config) noexcept;
  Sender() noexcept = default;

  /// As Exchange::send.
  [[nodiscard]] std::size_t send(Gate& gate, Ledger& ledger, Repair& repair, Instant now,
                                 std::span<std::byte> into, ExchangeReport& counted) noexcept;
  /// What was published and is to go out.
  void note_fresh(BlockKey key, VersionRange versions) noexcept {
    chunks_.note_fresh(key, versions);
    announce_soon_ = true;
  }
  /// Another contribution of this robot's is published from now on.
  void begin_own(const Ledger& ledger) noexcept {
    chunks_.begin_own();
    control_.begin_own(ledger);
  }
  void leave() noexcept {
    leave_due_ = true;
    presence_.forget_place();
  }
  [[nodiscard]] PresenceSender& presence() noexcept { return presence_; }
  [[nodiscard]] const PresenceSender& presence() const noexcept { return presence_; }
  [[nodiscard]] ControlWriter& control() noexcept { return control_; }
  [[nodiscard]] Answers& answers() noexcept { return chunks_.answers(); }
  [[nodiscard]] const Answers& answers() const noexcept { return chunks_.answers(); }

 private:
  void earn(Instant now) noexcept;
  [[nodiscard]] bool write_body(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_presence(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] static std::size_t append_signature(Outgoing& out, std::span<std::byte> into,
                                                    std::size_t size) noexcept;

  std::uint32_t robot_ = 0;
  std::uint64_t session_ = 0;
  std::uint32_t mission_ = 0;
  std::int64_t bytes_per_s_ = 0;
  std::int64_t burst_bytes_ = 0;
  std::int64_t budget_bytes_ = 0;
  Instant budget_at_;
  ControlWriter control_{};
  ChunkWriter chunks_{};
  PresenceSender presence_{};
  HashTree* tree_ = nullptr;  ///< Scratch.
  bool announce_soon_ = false;
  bool leave_due_ = false;
  std::uint64_t control_sequence_ = 0;  ///< Of what a window is kept of.
  std::uint64_t data_sequence_ = 0;
};

}  // namespace tessera
