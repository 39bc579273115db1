// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Recent statuses of robots. A status is accepted once, from the robot that it names, and from its
// current run.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "link/status_message.hpp"
#include "tessera/base/counters.hpp"
#include "tessera/exchange/peer_table.hpp"

namespace tessera {

#define TESSERA_STATUS_COUNTERS(ROW)                                                        \
  ROW(COUNTER, uint64_t, taken, "Statuses accepted.")                                       \
  ROW(COUNTER, uint64_t, refused_format, "Not of this format.")                             \
  ROW(COUNTER, uint64_t, refused_tag, "Damaged, or without the fleet's tag.")               \
  ROW(COUNTER, uint64_t, refused_robot, "With this robot's number.")                        \
  ROW(COUNTER, uint64_t, refused_replay, "Accepted before, or not of the current session.") \
  ROW(COUNTER, uint64_t, refused_rate, "More signatures than are checked per second.")      \
  ROW(COUNTER, uint64_t, refused_signature, "Also from a robot without a public key.")      \
  ROW(COUNTER, uint64_t, refused_places, "Of more robots than there are places.")

/// What became of each status given to a table: it is counted in one of these.
struct StatusTableReport {
  TESSERA_STATUS_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(StatusTableReport, TESSERA_STATUS_COUNTERS(TESSERA_COUNTER_ROW))

/// For one thread; no heap.
class StatusTable {
 public:
  static constexpr std::size_t kMostRobots = 64;
  /// A robot that was not heard for longer has stopped, or is out of reach.
  static constexpr std::int64_t kLately_us = 5'000'000;
  static constexpr std::uint32_t kChecksPerSecond = 128;

  using Place = std::pair<std::uint64_t, std::uint32_t>;  ///< Session and sequence.

  struct Entry {
    HeardState status{};
    std::int64_t heard_us = 0;
    Place highest{};  ///< Over all accepted statuses of this robot.
    [[nodiscard]] Place place() const noexcept { return {status.session, status.sequence}; }
    [[nodiscard]] bool is_lately(std::int64_t now_us) const noexcept {
      return now_us - heard_us <= kLately_us;
    }
  };

  /// own_robot: its statuses are refused, as a process does not receive its own; none: no robot's.
  StatusTable(const StatusKeys& keys, std::optional<std::uint32_t> own_robot) noexcept
      : keys_(keys), own_robot_(own_robot) {}

  /// Checks the tag first and the signature last, so a repeated status costs no signature. peers:
  /// those of an exchange of the same fleet; null: none. In a fleet that signs, only the session
  /// that the exchange currently has for a robot is accepted, even if it is lower than the last
  /// one: the robot may have lost its counter of starts. For a robot that the exchange does not
  /// know, (session, sequence) must rise. In a fleet that does not sign they must rise too, but a
  /// robot that was silent for kLately_us may come back with any session, as the highest can be
  /// forged with the key. If all places are taken, replaces a robot that was not heard recently,
  /// also in a fleet that signs. O(robots + peers). now_us: monotonic.
  PayloadVerdict hear(std::span<const std::byte> status, std::int64_t now_us,
                      const PeerTable* peers = nullptr) noexcept;

  [[nodiscard]] std::span<const Entry> entries() const noexcept {
    return std::span(entries_).first(count_);
  }
  [[nodiscard]] const StatusTableReport& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] Entry* find(std::uint32_t robot) noexcept;
  [[nodiscard]] Entry* place_for_new(std::int64_t now_us) noexcept;
  [[nodiscard]] bool is_replay(const Entry* before, const HeardState& now, std::int64_t now_us,
                               const PeerTable* peers) const noexcept;
  [[nodiscard]] bool may_check(std::int64_t now_us) noexcept;

  StatusKeys keys_;
  std::optional<std::uint32_t> own_robot_;
  std::array<Entry, kMostRobots> entries_{};
  std::size_t count_ = 0;
  StatusTableReport counters_{};
  std::int64_t second_us_ = 0;  ///< Begin of the second in which checks are counted.
  std::uint32_t checks_ = 0;
};

}  // namespace tessera
