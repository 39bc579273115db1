// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A node's word about itself, once a second, as a typed LCM message (lcmtypes/tessera_status.lcm)
// that lcm-spy and lcm-logger understand.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "lcm/datagram_link.hpp"

namespace tessera {

inline constexpr const char* kStatusChannel = "TESSERA_STATUS";

/// As lcmtypes/tessera_status.lcm says; counters are filled in by the publisher but for extra.
struct NodeStatus {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;
  std::uint32_t peers = 0;
  std::int64_t stamp_us = 0;  ///< Wall clock, since 1970.
  std::int32_t tick_median_us = 0;
  std::int32_t tick_max_us = 0;
  std::int64_t label_voxels = 0;
  std::int64_t free_voxels = 0;
  std::uint64_t digest = 0;
  std::uint32_t exclude_digest = 0;
  std::array<std::int64_t, 7> extra{};  ///< The node's own counters, after the 20 of the link.
};

class StatusPublisher {
 public:
  static constexpr std::int64_t kPeriod_us = 1'000'000;

  /// link: must outlive this.
  explicit StatusPublisher(DatagramLink& link) noexcept : link_(&link) {}

  /// Whether a second has passed since the last message. now_us: monotonic, microseconds.
  [[nodiscard]] bool is_due(std::int64_t now_us) const noexcept {
    return last_us_ == kNever || now_us - last_us_ >= kPeriod_us;
  }
  /// Sends status whatever the time, with the link's counters and its rates since the last call.
  /// False iff the link does not send it. Encodes into a buffer of its own: no heap.
  bool publish(const NodeStatus& status, std::int64_t now_us) noexcept;

 private:
  static constexpr std::int64_t kNever = INT64_MIN;
  static constexpr std::size_t kMaxBytes = 512;

  DatagramLink* link_;
  std::int64_t start_us_ = 0;
  std::int64_t last_us_ = kNever;
  LinkStatistics last_{};
  std::array<std::byte, kMaxBytes> buffer_{};
};

}  // namespace tessera
