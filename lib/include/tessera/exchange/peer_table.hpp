// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The robots that are heard: when last, and which of their datagrams, so that none counts twice.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {

/// Which datagrams were heard: of the latest session, the last kSize up to the highest number.
struct SequenceWindow {
  static constexpr std::uint32_t kSize = 64;

  std::uint32_t session = 0;
  std::uint32_t sequence = 0;  ///< The highest that was heard.
  std::uint64_t heard = 0;     ///< Bit i: sequence - i was; 0: nothing was.

  /// Whether a datagram is none that was heard before. Earlier ones are taken for heard. O(1).
  [[nodiscard]] bool is_new(std::uint32_t of_session, std::uint32_t number) const noexcept;
  /// Notes one that is new. O(1).
  void note(std::uint32_t of_session, std::uint32_t number) noexcept;
};

/// What is known of another robot that was heard.
struct Peer {
  std::uint32_t robot = 0;
  SequenceWindow control;     ///< Announcements, requests and leaves: each counts once.
  SequenceWindow data;        ///< Chunks and frames.
  std::int64_t heard_us = 0;  ///< When last something of it was heard that was no repeat.
  std::uint64_t datagrams = 0;
  bool left = false;
  /// Its configuration where it is another than ours: why nothing of it is taken.
  std::optional<ConfigurationDetails> mismatch;
};

class PeerTable {
 public:
  /// After which a robot that is silent makes room for another, where room is short.
  static constexpr std::int64_t kSilentUs = 60'000'000;

  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t peers) noexcept {
    return arena_bytes<Peer>(peers);
  }
  [[nodiscard]] static Result<PeerTable> make(Arena& arena, std::uint32_t peers) noexcept;
  PeerTable() noexcept = default;

  /// The robot's peer; added if it is not there, in place of the one that has been silent longest
  /// if the table is full. Null iff it is full of robots heard within kSilentUs. O(peers).
  [[nodiscard]] Peer* find_or_add(std::uint32_t robot, std::int64_t now_us) noexcept;
  /// The robot's peer, or null. O(peers).
  [[nodiscard]] Peer* find(std::uint32_t robot) const noexcept;
  [[nodiscard]] std::span<const Peer> all() const noexcept { return peers_.first(count_); }

 private:
  std::span<Peer> peers_;
  std::size_t count_ = 0;
};

}  // namespace tessera
