// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The status of a node, once a second, as a typed LCM message (lcmtypes/tessera_status.lcm) that
// lcm-spy and lcm-logger understand.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "link/datagram_link.hpp"
#include "link/status_message.hpp"

namespace tessera {

inline constexpr std::int32_t kStatusVersion = 5;
/// Counters of the link, before those of the node.
inline constexpr std::size_t kLinkCounters = kCounters<LinkReport>.size();
static_assert(kLinkCounters == 21, "statuses have them: raise kStatusVersion");

/// A robot that most others contradict.
struct DoubtedRobot {
  std::uint32_t robot = 0;
  std::uint64_t classes = 0;  ///< A bit each.
};

/// As in lcmtypes/tessera_status.lcm; the publisher sets all counters except extra.
struct NodeState {
  static constexpr std::size_t kOwnTwins = 6;    ///< In extra.
  static constexpr std::size_t kOtherTwins = 7;  ///< In extra.
  static constexpr std::size_t kConflicts = 8;   ///< In extra.

  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;
  std::uint32_t peers = 0;
  std::uint64_t session = 0;  ///< After the typed message; grows with each start.
  std::int64_t stamp_us = 0;  ///< Wall clock, since 1970.
  std::int32_t tick_median_us = 0;
  std::int32_t tick_max_us = 0;
  std::int64_t label_voxels = 0;
  std::int64_t free_voxels = 0;
  std::uint64_t digest = 0;
  std::uint32_t exclude_digest = 0;
  std::uint32_t doubted = 0;                    ///< How many there are.
  std::array<DoubtedRobot, 8> first_doubted{};  ///< By number.
  std::array<std::int64_t, 9> extra{};          ///< The node's counters, after those of the link.
};

class StatusPublisher {
 public:
  static constexpr std::int64_t kPeriod_us = 1'000'000;

  /// link, and what keys point to, must outlive this.
  explicit StatusPublisher(DatagramLink& link, const StatusKeys& keys = {}) noexcept
      : link_(&link), keys_(keys) {}

  /// True if a second has passed since the last message. now_us: monotonic, microseconds.
  [[nodiscard]] bool is_due(std::int64_t now_us) const noexcept {
    return last_us_ == kNever || now_us - last_us_ >= kPeriod_us;
  }
  /// Sends status at any time, with the link's counters and its rates since the last call. False
  /// iff the link does not send it, or after 2^32 - 1 of them: sequence numbers are never reused.
  /// Encodes into its own buffer: no heap.
  bool publish(const NodeState& status, std::int64_t now_us) noexcept;

 private:
  static constexpr std::int64_t kNever = INT64_MIN;

  DatagramLink* link_;
  StatusKeys keys_;
  std::uint32_t sequence_ = 0;
  std::int64_t start_us_ = 0;
  std::int64_t last_us_ = kNever;
  LinkReport last_{};
  std::array<std::byte, kMostStatusBytes> buffer_{};
};

}  // namespace tessera
