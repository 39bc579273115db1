// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots said of themselves lately. A status is taken once, of the robot that it names, and of
// no earlier run of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "lcm/status_message.hpp"

namespace tessera {

/// What became of each status that was given to a table: it is in one of these.
struct StatusCounters {
  std::uint64_t taken = 0;
  std::uint64_t refused_format = 0;
  std::uint64_t refused_tag = 0;
  std::uint64_t refused_robot = 0;      ///< Of this robot's own number.
  std::uint64_t refused_replay = 0;     ///< Not newer than the last one of that robot.
  std::uint64_t refused_rate = 0;       ///< More signatures than are checked in a second.
  std::uint64_t refused_signature = 0;  ///< Of a robot without a public key, too.
  std::uint64_t refused_places = 0;     ///< Of more robots than have a place.
};

/// For one thread; no heap.
class StatusTable {
 public:
  static constexpr std::size_t kMostRobots = 64;
  /// A robot that was not heard for longer has stopped, or is out of reach.
  static constexpr std::int64_t kLately_us = 5'000'000;
  static constexpr std::uint32_t kChecksPerSecond = 128;

  struct Entry {
    HeardStatus status{};
    std::int64_t heard_us = 0;
    [[nodiscard]] bool is_lately(std::int64_t now_us) const noexcept {
      return now_us - heard_us <= kLately_us;
    }
  };

  /// own_robot: whose statuses are refused, as its own process does not hear itself; none:
  /// nobody's.
  StatusTable(const StatusKeys& keys, std::optional<std::uint32_t> own_robot) noexcept
      : keys_(keys), own_robot_(own_robot) {}

  /// Tag first, the signature last: what is heard again costs none. In a fleet that does not sign,
  /// a robot that was silent for kLately_us may come back with any session, as whoever has the key
  /// can forge the highest. Where all places are taken, one of a robot that was not heard lately is
  /// given away, in a fleet that signs too. O(robots). now_us: monotonic.
  PayloadVerdict hear(std::span<const std::byte> status, std::int64_t now_us) noexcept;

  [[nodiscard]] std::span<const Entry> entries() const noexcept {
    return std::span(entries_).first(count_);
  }
  [[nodiscard]] const StatusCounters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] Entry* find(std::uint32_t robot) noexcept;
  [[nodiscard]] Entry* place_for_new(std::int64_t now_us) noexcept;
  [[nodiscard]] bool is_replay(const Entry& before, const HeardStatus& now,
                               std::int64_t now_us) const noexcept;
  [[nodiscard]] bool may_check(std::int64_t now_us) noexcept;

  StatusKeys keys_;
  std::optional<std::uint32_t> own_robot_;
  std::array<Entry, kMostRobots> entries_{};
  std::size_t count_ = 0;
  StatusCounters counters_{};
  std::int64_t second_us_ = 0;  ///< When the second began in which checks are counted.
  std::uint32_t checks_ = 0;
};

}  // namespace tessera
