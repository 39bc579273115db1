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
  /// Writes the announcement, if it is due. O(contributions).
  [[nodiscard]] bool write_announcement(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] bool announces(Instant now) const noexcept { return now >= announce_due_; }
  /// Another contribution of this robot's is published from now on.
  void begin_own(const Ledger& ledger) noexcept;
  /// An announcement is due soon, if none is sooner. O(1).
  void announce_soon(Instant now) noexcept {
    const Instant soon = now + announce_soon_time_;
    if (soon < announce_due_) announce_due_ = soon;
  }
  /// Who asks for a frame or a statement.
  struct Asker {
    std::uint32_t robot = 0;
    bool may_ask = false;  ///< False: it has used up what it is answered, and gets it seldom.
  };
  /// A frame or statement is to be sent, by others than its origin only if nobody else does. Whose
  /// asking makes it due is charged for it, as long as it may ask.
  void owe_frame(const Ledger& ledger, const Ledger::Contribution& contribution, Instant at,
                 const std::optional<Asker>& asker = {}) noexcept;
  void owe_statement(const Ledger& ledger, const Ledger::Contribution& contribution, Instant at,
                     const std::optional<Asker>& asker = {}) noexcept;
  /// Has the frame of what this robot publishes sent, where its blocks are well beyond what the
  /// others know of their extent; at_end: where they are beyond it. O(1).
  void note_extent(const Ledger& ledger, bool at_end = false) noexcept;
  /// Another robot has sent it.
  void drop_frame(const Ledger& ledger, const Ledger::Contribution& contribution) noexcept;
  void drop_statement(const Ledger& ledger, const Ledger::Contribution& contribution) noexcept;

 private:
  /// When a frame or statement is due, and was sent last.
  struct Owed {
    Instant due = Instant::never();
    Instant sent;
    std::optional<std::uint32_t> asker;  ///< Who is charged for it.
  };
  /// Of a contribution, by its place.
  struct Due {
    std::uint32_t generation = 0;
    Owed frame;
    Owed statement;
  };
  [[nodiscard]] Due& due_of(const Ledger& ledger,
                            const Ledger::Contribution& contribution) noexcept;
  static void owe(Owed& owed, Instant at, Duration pause,
                  const std::optional<Asker>& asker) noexcept;
  /// It is in this datagram.
  static void settle(Owed& owed, Outgoing& out) noexcept;
  void owe_own(const Outgoing& out) noexcept;
  [[nodiscard]] static bool announce(const Outgoing& out, ByteWriter& to, bool own,
                                     std::uint32_t& next) noexcept;
  void announce_floors(const Outgoing& out, ByteWriter& to) const noexcept;
  [[nodiscard]] bool write_due_frame(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] bool write_due_statement(Outgoing& out, ByteWriter& to) noexcept;
  [[nodiscard]] static bool write_due_conflict(Outgoing& out, ByteWriter& to) noexcept;

  Duration announce_{};
  Duration announce_soon_time_{};
  Duration frame_pause_{};
  std::span<Due> dues_;
  /// The places that the next announcement begins with, of others and of this robot's own.
  std::uint32_t announced_next_ = 0;
  std::uint32_t announced_own_ = 0;
  bool own_only_ = false;      ///< This robot's own left no room in the last announcement.
  bool others_first_ = false;  ///< In the last announcement.
  Instant announce_due_ = Instant::long_ago();
};

}  // namespace tessera
