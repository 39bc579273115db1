// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A second channel of a link, with a queue of its own: what comes there displaces nothing of the
// first, and is judged before it takes a place.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "lcm/payload_check.hpp"
#include "lcm/short_message.hpp"
#include "posix/spsc_queue.hpp"

namespace tessera {

struct SideChannel {
  std::string channel = {};  ///< Empty: there is none.
  PayloadCheck check{};
  std::size_t queue_slots = 64;
};

/// What became of what came on a side channel. None ever decreases.
struct SideStatistics {
  std::uint64_t received = 0;
  std::uint64_t refused_format = 0;
  std::uint64_t refused_tag = 0;
  std::uint64_t refused_excluded = 0;
  std::uint64_t queue_full = 0;
};

/// One thread calls take(), one receive(). Only making it uses the heap.
class SideIntake {
 public:
  explicit SideIntake(const SideChannel& config);

  [[nodiscard]] bool is_for(std::string_view channel) const noexcept {
    return !config_.channel.empty() && channel == config_.channel;
  }
  /// Whether the payload passes the check; it is counted as lost where it then finds no place.
  bool take(std::span<const std::byte> payload) noexcept;
  /// Copies the oldest payload that waits to into; empty: nothing waits.
  std::span<const std::byte> receive(std::span<std::byte, kMaxMessageBytes> into) noexcept;
  /// For any thread.
  [[nodiscard]] SideStatistics statistics() const noexcept;

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
