// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What arrives, by kind, and which part of the exchange it is for.
#pragma once

#include "tessera/exchange/internal/announcement_taker.hpp"

namespace tessera {

class MessageTaker {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<RequestedContribution>(1) + arena_bytes<Description>(1) +
           arena_bytes<ChunkHeader>(1) + arena_bytes<HashTree>(1);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<MessageTaker> make(Arena& arena,
                                                 const ExchangeConfig& config) noexcept;
  MessageTaker() noexcept = default;

  /// Takes what passed the gate. Counts it as refused_body if the body is none of its kind.
  void hear(const ExchangeParts& parts, const Heard& heard) noexcept {
    if (!hear_kind(parts, heard)) ++parts.counted.refused_body;
    announcements_.judge_conflicts(parts);
  }
  [[nodiscard]] const AnnouncementTaker& announcements() const noexcept { return announcements_; }

 private:
  [[nodiscard]] bool hear_kind(const ExchangeParts& parts, const Heard& heard) noexcept;
  [[nodiscard]] bool hear_request(const ExchangeParts& parts, const Heard& heard) noexcept;
  void hear_requested(const ExchangeParts& parts, const Heard& heard) noexcept;
  void hear_gaps(const ExchangeParts& parts, const Heard& heard,
                 const HeldContribution& contribution) noexcept;
  void hear_targeted(const ExchangeParts& parts, const Heard& heard,
                     const HeldContribution& contribution) noexcept;
  [[nodiscard]] Instant frames_at(const ExchangeParts& parts, Instant now, bool own) noexcept;
  [[nodiscard]] bool hear_chunk(const ExchangeParts& parts, const Heard& heard) noexcept;
  void hear_own_chunk(const ExchangeParts& parts, const Heard& heard,
                      std::span<const std::byte> body) noexcept;
  /// True if somebody waits for versions of the chunk.
  [[nodiscard]] bool is_awaited(const ExchangeParts& parts,
                                const HeldContribution& contribution) const noexcept {
    return parts.sender.answers().touches(parts.ledger.number_of(contribution), chunk_->range);
  }
  void drop_answers(const ExchangeParts& parts, const Heard& heard,
                    const HeldContribution& contribution, std::uint32_t held) const noexcept;
  [[nodiscard]] bool hear_frames(const ExchangeParts& parts, const Heard& heard) noexcept;
  [[nodiscard]] bool read_frames(const ExchangeParts& parts, const FramesHeader& header,
                                 std::span<const std::byte> frames) noexcept;
  [[nodiscard]] bool hear_frame(const ExchangeParts& parts, const Heard& heard,
                                const FrameBody& frame,
                                std::span<const std::byte> proof) const noexcept;
  [[nodiscard]] bool hear_statement(const ExchangeParts& parts, const Heard& heard) const noexcept;
  [[nodiscard]] bool hear_description(const ExchangeParts& parts, const Heard& heard) noexcept;
  /// own: of a contribution that this robot publishes.
  [[nodiscard]] Duration answer_delay(const ExchangeParts& parts, bool own) const noexcept;

  std::uint32_t robot_ = 0;
  Duration answer_{};
  Duration announce_{};
  AnnouncementTaker announcements_{};
  RequestedContribution* requested_ = nullptr;  ///< Scratch: the one that is heard.
  Description* description_ = nullptr;          ///< Likewise.
  ChunkHeader* chunk_ = nullptr;                ///< Likewise.
  HashTree* frames_ = nullptr;                  ///< Likewise: of the frames that are heard.
  /// When frames that a request asks for are due: of others and of this robot.
  std::array<std::optional<Instant>, 2> frames_at_{};
};

}  // namespace tessera
