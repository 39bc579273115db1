// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Inputs and outputs of the exchange: its settings, where replicas are kept, and its report.
#pragma once

#include <cstdint>

#include "tessera/base/counters.hpp"
#include "tessera/exchange/exchange_counters.h"
#include "tessera/exchange/wire.hpp"
#include "tessera/replica/replica_store.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

struct ExchangeConfig {
  static constexpr std::size_t kMostExcluded = 16;

  std::uint32_t robot = 0;
  /// Of this process. The upper 32 bits are higher with every start of the robot, from a counter
  /// that outlives it and never from a clock; the lower 32 are random, so that two processes with
  /// one number are told apart.
  std::uint64_t session = std::uint64_t{1} << 32U;
  /// Of the mission's name; datagrams of another mission are refused. 0 without a fleet key.
  std::uint32_t mission = 0;
  double resolution_m = 0.1;  ///< As MapConfig; so are the next two.
  double prior = 0.001;
  float free_weight = 0.4F;
  /// As GlobalMapConfig: the most that one robot's evidence counts in a voxel. Robots must agree on
  /// it.
  float max_evidence = 250.0F;
  /// What follows where a robot signed two contents of one version. Robots must agree on it.
  ConflictPolicy conflicts = ConflictPolicy::kAlarm;
  std::uint32_t contributions = 64;  ///< That are known of, at most; Replicas::kMostContributions.
  /// Of one robot, at most: those with the highest epochs and submaps.
  std::uint32_t contributions_per_robot = 4;
  /// Contributions of which no records are held, as they are far (Exchange::set_reach), at most.
  /// 0: all that are known are held, as far as there is room.
  std::uint32_t far_contributions = 0;
  /// Of contributions, places that only open() takes: nothing that is heard fills them.
  std::uint32_t own_contributions = 1;
  std::uint32_t records = 1U << 15U;  ///< As ReplicasConfig::blocks.
  std::uint32_t peers = 64;           ///< Robots that are heard, at most.
  std::uint32_t teammates = 16;       ///< Robots whose places are known, at most 64 (Teammates).
  std::uint32_t answers = 256;        ///< Ranges of versions that others wait for, at most.
  std::uint32_t picks = 8192;         ///< Single records that others wait for, at most.
  /// Parts that were published and have not gone out, which are found without a search; of more the
  /// first are searched for among all.
  std::uint32_t fresh = 4096;
  /// What send() gives in all, over any time, is at most this rate and a burst.
  std::uint32_t bytes_per_s = 1'500'000;
  std::uint32_t burst_bytes = 128U << 10U;
  /// From the first call of receive() or send() on nothing is sent for so long: a robot that lost
  /// its counters hears first what the others know about it.
  std::int64_t listen_us = 0;
  std::int64_t announce_us = 1'000'000;      ///< Between announcements where nothing happens.
  std::int64_t announce_soon_us = 150'000;   ///< After something was published.
  std::int64_t request_us = 150'000;         ///< From a lack that is noticed to asking for it.
  std::int64_t request_most_us = 1'000'000;  ///< Between requests that nobody answers yet.
  /// The same where nobody is heard who has anything else: what never left a robot that is gone is
  /// nowhere. Also the longest between comparisons that change nothing.
  std::int64_t request_idle_us = 30'000'000;
  std::int64_t answer_us = 60'000;    ///< Within which others than the origin answer.
  std::int64_t frame_us = 1'000'000;  ///< Between revisions of a frame that are taken or sent.
};

/// The lowest epoch of a robot that counts, as it stated itself.
struct RobotFloor {
  std::uint32_t robot = 0;
  std::uint32_t floor = 0;
  friend bool operator==(const RobotFloor&, const RobotFloor&) = default;
};

/// What a robot has of a contribution.
struct ContributionState {
  ContributionId id;
  bool own = false;
  /// It holds what the origin's newest statement says that there is. Objections of an epoch that
  /// their robot has left are complete with what robots have of them.
  bool complete = false;
  bool far = false;           ///< It asks for no records of it: they are far.
  std::uint32_t latest = 0;   ///< Of that statement.
  std::uint32_t covered = 0;  ///< Versions up to here are not asked for one by one.
  std::uint32_t records = 0;  ///< That it holds.
  std::uint64_t digest = 0;   ///< Of these, or of what is stated: Fingerprint::folded().
  MapSession session{};       ///< If it is one (MapSession::is).
};

/// How the exchange stands, and what it has received and sent.
struct ExchangeReport {
  TESSERA_EXCHANGE_COUNTERS(TESSERA_COUNTER_MEMBER)
  TESSERA_EXCHANGE_STATE(TESSERA_COUNTER_MEMBER)
  /// Each contribution that is known is complete here, but for far ones.
  [[nodiscard]] bool holds_all() const noexcept {
    return complete + far_contributions == contributions;
  }
};
TESSERA_COUNTER_TABLE(ExchangeReport, TESSERA_EXCHANGE_COUNTERS(TESSERA_COUNTER_ROW)
                                          TESSERA_EXCHANGE_STATE(TESSERA_COUNTER_ROW))

}  // namespace tessera
