// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The robots that are heard: when last, and which of their datagrams, so that none counts twice.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/instant.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {

/// Which datagrams were heard: of one session, the last kSize up to the highest number.
struct SequenceWindow {
  static constexpr std::uint64_t kSize = 64;

  std::uint64_t session = 0;
  std::uint64_t sequence = 0;  ///< The highest that was heard.
  std::uint64_t heard = 0;     ///< Bit i: sequence - i was; 0: nothing was.

  /// True iff something was heard, and of another session.
  [[nodiscard]] bool is_of_another(std::uint64_t of_session) const noexcept {
    return heard != 0 && of_session != session;
  }
  /// True if this sequence number of the session is new; numbers older than the window count as
  /// seen. O(1).
  [[nodiscard]] bool is_new(std::uint64_t number) const noexcept;
  /// Notes a datagram. Another session begins anew. O(1).
  void note(std::uint64_t of_session, std::uint64_t number) noexcept;
};

/// Lets so many through a second, and as many at once.
struct RateLimit {
  std::int64_t credit_us = 0;  ///< What one costs is 1 s / rate.
  Instant last = Instant::long_ago();
  /// True iff one more may pass now. most: what may pass at once after a pause, as time.
  [[nodiscard]] bool pass(std::int64_t per_s, Instant now,
                          Duration most = Duration{1'000'000}) noexcept;
};

/// What is known of another robot that was heard.
struct Peer {
  static constexpr std::int64_t kMostWalk = 1'000'000;

  std::uint32_t robot = 0;
  SequenceWindow control;  ///< Announcements, requests, descriptions and leaves: each counts once.
  SequenceWindow data;     ///< Chunks, frames and statements.
  Instant heard;           ///< When last something of it was heard that was no repeat.
  Instant advanced;        ///< When the sequence of its control messages last grew.
  std::uint64_t datagrams = 0;
  bool left = false;
  std::uint32_t floor = 0;  ///< That it announced last.
  /// The highest epoch in which it announced last that it publishes, if it does.
  std::optional<std::uint32_t> epoch;
  Instant agreed;    ///< When it last announced what this robot publishes as it is.
  Instant differed;  ///< When it last announced something that is other here.
  RateLimit checks;  ///< Of signatures of its requests.
  RateLimit announcements;
  RateLimit presences;       ///< Of those without an announcement.
  RateLimit other_sessions;  ///< Of all that names another session than the one at work.
  /// Not 0: the nonce by which it is to prove that its session is the one at work.
  std::uint64_t nonce = 0;
  Instant challenged;        ///< When it was asked last.
  Instant doubted;           ///< When something came that only it could explain by its nonce.
  Instant session_changed;   ///< When it proved a session that was not later than the one before.
  std::uint64_t answer = 0;  ///< Not 0: the nonce that it wants to see answered.
  /// Bytes that may be sent to answer it; spent below zero, it waits.
  std::int64_t allowance_bytes = 0;
  std::int64_t waiting_bytes = 0;     ///< Scratch: about what waits to be sent to it.
  std::uint64_t allowance_taken = 0;  ///< Ledger::taken_bytes() when that was counted.
  Instant allowance_at;
  /// Records that may be looked at to answer it; spent below zero, it waits.
  std::int64_t walk = kMostWalk;
  Instant walk_at;
  Instant compare_due;         ///< When contents may be compared with it again.
  Instant allowance_renewed;   ///< When a new process of it began with all of it again.
  Duration allowance_pause{};  ///< Until that may be the next time.
  /// Its configuration where it is another than ours: why nothing of it is taken.
  std::optional<ConfigurationDetails> mismatch;
};

class PeerTable {
 public:
  /// After which a robot that is silent makes room for another, where room is short.
  static constexpr Duration kSilent{60'000'000};
  /// The same where whoever has the fleet's key can speak for robots that do not exist.
  static constexpr Duration kSilentUnsigned{10'000'000};

  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t peers) noexcept {
    return arena_bytes<Peer>(peers);
  }
  [[nodiscard]] static Result<PeerTable> make(Arena& arena, std::uint32_t peers) noexcept;
  PeerTable() noexcept = default;

  /// The robot's peer; added if it is not there, in place of the one that has been silent longest
  /// if the table is full. Null iff it is full of robots heard within silent. O(peers).
  [[nodiscard]] Peer* find_or_add(std::uint32_t robot, Instant now,
                                  Duration silent = kSilent) noexcept;
  /// The robot's peer, or null. O(peers).
  [[nodiscard]] Peer* find(std::uint32_t robot) const noexcept;
  [[nodiscard]] std::span<const Peer> all() const noexcept { return peers_.first(count_); }
  [[nodiscard]] std::span<Peer> all() noexcept { return peers_.first(count_); }

 private:
  std::span<Peer> peers_;
  std::size_t count_ = 0;
};

}  // namespace tessera
