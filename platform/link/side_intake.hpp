// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A second channel of a link, with its own queue: its payloads displace none of the first, and are
// checked before they take a place.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "base/spsc_queue.hpp"
#include "link/payload_check.hpp"
#include "link/short_message.hpp"
#include "tessera/base/counters.hpp"

namespace tessera {

struct SideChannel {
  std::string channel = {};  ///< Empty: there is none.
  PayloadCheck check{};
  std::size_t queue_slots = 64;
};

#define TESSERA_SIDE_COUNTERS(ROW)                                            \
  ROW(COUNTER, uint64_t, received, "Statuses received.")                      \
  ROW(COUNTER, uint64_t, refused_format, "Not of this format.")               \
  ROW(COUNTER, uint64_t, refused_tag, "Damaged, or without the fleet's tag.") \
  ROW(COUNTER, uint64_t, refused_excluded, "Of an excluded robot.")           \
  ROW(COUNTER, uint64_t, queue_full, "Lost here, as the queue was full.")

/// What became of payloads of a side channel. None ever decreases.
struct SideReport {
  TESSERA_SIDE_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(SideReport, TESSERA_SIDE_COUNTERS(TESSERA_COUNTER_ROW))

/// One thread calls take(), one receive(). Only the constructor uses the heap.
class SideIntake {
 public:
  explicit SideIntake(const SideChannel& config);

  [[nodiscard]] bool is_for(std::string_view channel) const noexcept {
    return !config_.channel.empty() && channel == config_.channel;
  }
  /// Returns whether the payload passes the check; counts it as lost if the queue is full.
  bool take(std::span<const std::byte> payload) noexcept;
  /// Copies the oldest payload that waits to into; empty: nothing waits.
  std::span<const std::byte> receive(std::span<std::byte, kMaxMessageBytes> into) noexcept;
  /// For any thread.
  [[nodiscard]] SideReport report() const noexcept;

 private:
  struct Slot {
    std::uint32_t bytes = 0;
    std::array<std::byte, kMaxMessageBytes> payload{};
  };
  enum Counter : std::uint8_t {
    kReceived,
    kRefusedFormat,
    kRefusedTag,
    kRefusedExcluded,
    kQueueFull,
    kCount
  };
  void count(Counter counter) noexcept {
    counters_[counter].fetch_add(1, std::memory_order_relaxed);
  }

  const SideChannel config_;
  SpscQueue<Slot> queue_;
  std::array<std::atomic<std::uint64_t>, kCount> counters_{};
};

}  // namespace tessera
