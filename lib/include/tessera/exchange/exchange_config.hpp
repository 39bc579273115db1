// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Inputs and outputs of the exchange: its settings, where replicas are kept, and its report.
#pragma once

#include <cstdint>

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
  /// Of contributions, places that only open() takes: nothing that is heard fills them.
  std::uint32_t own_contributions = 1;
  std::uint32_t records = 1U << 15U;  ///< As ReplicasConfig::blocks.
  std::uint32_t peers = 64;           ///< Robots that are heard, at most.
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
  bool complete = false;      ///< It holds what the origin's newest statement says that there is.
  std::uint32_t latest = 0;   ///< Of that statement.
  std::uint32_t covered = 0;  ///< Versions up to here are not asked for one by one.
  std::uint32_t records = 0;  ///< That it holds.
  std::uint64_t digest = 0;   ///< Of these: Fingerprint::folded().
};

/// Counters never decrease.
struct ExchangeReport {
  // Datagrams that were received, each counted once more below if it was refused.
  std::uint64_t received = 0;
  std::uint64_t received_bytes = 0;
  std::uint64_t refused_size = 0;           ///< Shorter than a header and a tag, or too long.
  std::uint64_t refused_format = 0;         ///< No header of this format.
  std::uint64_t refused_mission = 0;        ///< Of another mission.
  std::uint64_t refused_tag = 0;            ///< Damaged, or of none who has the key.
  std::uint64_t refused_signature = 0;      ///< Not signed by the robot that it names.
  std::uint64_t refused_rate = 0;           ///< More signed messages than one robot may send.
  std::uint64_t refused_configuration = 0;  ///< Another resolution, class table, scale or policy.
  std::uint64_t refused_replay = 0;         ///< Heard before, or of a session that is over.
  std::uint64_t refused_robot = 0;          ///< Another process with this robot's number.
  std::uint64_t refused_excluded = 0;
  std::uint64_t refused_peers = 0;  ///< No place in the table of peers.
  std::uint64_t refused_body = 0;   ///< Well tagged, but no body of its kind.
  std::uint64_t own_echoes = 0;
  // What was in them.
  std::uint64_t records_taken = 0;
  std::uint64_t records_stale = 0;
  std::uint64_t records_refused = 0;  ///< No room, or the robot's quota: asked for again later.
  std::uint64_t records_early = 0;    ///< Chunks of contributions whose frame is not known yet.
  std::uint64_t refused_contributions = 0;  ///< Times that there was no place for another.
  /// Contributions whose place another one took.
  std::uint64_t displaced_contributions = 0;
  std::uint64_t ended_contributions = 0;  ///< Removed, as their origin no longer counts them.
  std::uint64_t refused_epochs = 0;       ///< Times that something below its robot's floor came.
  std::uint64_t frames_early = 0;         ///< Revisions of frames that came too soon.
  /// Times that two contents of one version, or of one moment, were found: by a proof, or in a
  /// fleet that does not sign by one that replaced the other.
  std::uint64_t conflicts = 0;
  /// Proofs of such conflicts that were found or received, one for each epoch of a robot.
  std::uint64_t conflict_proofs = 0;
  std::uint64_t refused_disputed = 0;  ///< Times that something came of an epoch that one ended.
  std::uint64_t diverged = 0;          ///< Times that a comparison of contents was begun.
  std::uint64_t impostors = 0;         ///< Claims that this robot said what it did not.
  std::uint64_t twins = 0;             ///< Times that a peer's number was used by two processes.
  // What was sent.
  std::uint64_t sent = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t announcements = 0;
  std::uint64_t requests = 0;
  std::uint64_t requests_saved = 0;  ///< Another robot asked for the same.
  std::uint64_t frames = 0;
  std::uint64_t statements = 0;
  std::uint64_t descriptions = 0;
  std::uint64_t fresh_chunks = 0;
  std::uint64_t answer_chunks = 0;
  std::uint64_t answer_bytes = 0;     ///< Of sent_bytes: answers, statements and descriptions.
  std::uint64_t answers_saved = 0;    ///< Another robot gave the same.
  std::uint64_t refused_answers = 0;  ///< No place for what was asked for.
  std::uint64_t published_parts = 0;
  std::uint64_t refused_parts = 0;
  // How things stand.
  std::uint32_t contributions = 0;
  std::uint32_t complete = 0;  ///< Of these, those that hold what their origin states.
  std::uint32_t peers = 0;
  std::uint32_t waiting_answers = 0;
  std::uint32_t banned = 0;  ///< Robots that three such proofs exclude.
};

}  // namespace tessera
