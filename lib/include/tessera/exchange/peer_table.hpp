// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The robots that are heard: when last, and which of their datagrams, so that none counts twice.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {

struct Peer {
  std::uint32_t robot = 0;
  std::uint32_t session = 0;
  std::uint32_t sequence = 0;  ///< The highest that was heard of its control messages.
  std::uint64_t window = 0;    ///< Bit i: sequence - i was heard.
  std::uint32_t data_session = 0;
  std::uint32_t data_sequence = 0;  ///< The highest that was heard of its chunks and frames.
  std::int64_t heard_us = 0;        ///< When last something of it was heard that was no repeat.
  std::uint64_t datagrams = 0;
  bool left = false;
  /// Its configuration where it is another than ours: why nothing of it is taken.
  std::optional<ConfigurationDetails> mismatch;
};

class PeerTable {
 public:
  /// After which a robot that is silent makes room for another, where room is short.
  static constexpr std::int64_t kSilentUs = 60'000'000;
  static constexpr std::uint32_t kWindow = 64;

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
  /// Whether a control message is none that was heard before. Those older than the last kWindow
  /// are taken for heard. O(1).
  [[nodiscard]] static bool is_new(const Peer& peer, std::uint32_t session,
                                   std::uint32_t sequence) noexcept;
  /// Notes one that is new. O(1).
  static void note(Peer& peer, std::uint32_t session, std::uint32_t sequence) noexcept;
  /// The same for a chunk or a frame, which may be heard again: true iff it is later than all that
  /// were noted. O(1).
  static bool note_data(Peer& peer, std::uint32_t session, std::uint32_t sequence) noexcept;
  [[nodiscard]] std::span<const Peer> all() const noexcept { return peers_.first(count_); }

 private:
  std::span<Peer> peers_;
  std::size_t count_ = 0;
};

}  // namespace tessera
