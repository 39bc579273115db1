// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is sent beside evidence, and when it is due: announcements, frames, statements and proofs of
// conflicts.
#pragma once

#include "tessera/exchange/internal/outgoing.hpp"

namespace tessera {

class ControlWriter {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return arena_bytes<Due>(config.contributions);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<ControlWriter> make(Arena& arena,
                                                  const ExchangeConfig& config) noexcept;
  ControlWriter() noexcept = default;

  /// Writes what is due next, if anything is. O(contributions).
  [[nodiscard]] bool write(Outgoing& out, ByteWriter& to) noexcept;
  /// Another contribution of this robot's is published from now on.
  void begin_own(const Ledger& ledger) noexcept;
  /// An announcement is due soon, if none is sooner. O(1).
  void announce_soon(Instant now) noexcept {
    const Instant soon = now + announce_soon_time_;
    if (soon < announce_due_) announce_due_ = soon;
  }
  /// A frame or statement is to be sent, by others than its origin only if nobody else does.
  /// seldom: for who has used up what it is answered.
  void owe_frame(const Ledger& ledger, const Ledger::Contribution& contribution, Instant at,
                 bool seldom = false) noexcept;
  void owe_statement(const Ledger& ledger, const Ledger::Contribution& contribution, Instant at,
                     bool seldom = false) noexcept;
  /// Another robot has sent it.
  void drop_frame(const Ledger& ledger, const Ledger::Contribution& contribution) noexcept;
  void drop_statement(const Ledger& ledger, const Ledger::Contribution& contribution) noexcept;

 private:
  /// Of a contribution, by its place: when what is owed is due, and was sent last.
  struct Due {
    std::uint32_t generation = 0;
    Instant frame = Instant::never();
    Instant statement = Instant::never();
    Instant frame_sent;
    Instant statement_sent;
  };
  [[nodiscard]] Due& due_of(const Ledger& ledger,
                            const Ledger::Contribution& contribution) noexcept;
  [[nodiscard]] bool write_announcement(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_due_frame(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_due_statement(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] static bool write_due_conflict(Outgoing& out, ByteWriter& to) noexcept;

  Duration announce_{};
  Duration announce_soon_time_{};
  Duration frame_pause_{};
  std::span<Due> dues_;
  std::uint32_t announced_next_ = 0;  ///< The place that the next announcement begins with.
  Instant announce_due_ = Instant::long_ago();
};

}  // namespace tessera
