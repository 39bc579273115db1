// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What became of every datagram that reached a link or left it: one counter for each outcome. None
// ever decreases.
#pragma once

#include <atomic>
#include <cstdint>

namespace tessera {

struct LinkStatistics {
  std::uint64_t received = 0;          ///< Received, or waiting for receive().
  std::uint64_t received_bytes = 0;    ///< Their payload.
  std::uint64_t own = 0;               ///< Sent by this link, received again and ignored.
  std::uint64_t other_channel = 0;     ///< LCM messages that are not for this link.
  std::uint64_t too_short = 0;         ///< No room for LCM's header, or no payload.
  std::uint64_t too_long = 0;          ///< Over 1,408 bytes; only these were read.
  std::uint64_t fragments = 0;         ///< Parts of long LCM messages; never assembled.
  std::uint64_t foreign = 0;           ///< Not an LCM message.
  std::uint64_t no_channel = 0;        ///< Channel name empty, too long or unterminated.
  std::uint64_t refused_format = 0;    ///< On the channel, but not of its format.
  std::uint64_t refused_mission = 0;   ///< Of another mission.
  std::uint64_t refused_tag = 0;       ///< Damaged, or from a sender without the key.
  std::uint64_t refused_excluded = 0;  ///< Of an excluded sender.
  std::uint64_t queue_full = 0;  ///< Lost here: call receive() more often, or use more queue_slots.
  std::uint64_t kernel_dropped = 0;  ///< Lost before this link: use a larger recv_buf_size.
  std::uint64_t missing = 0;         ///< Lost on the network, by the numbers of their senders.
  std::uint64_t sent = 0;
  std::uint64_t sent_bytes = 0;  ///< Their payload.
  std::uint64_t refused = 0;     ///< Not sent: empty, too long, or no channel.
  std::uint64_t failed = 0;      ///< Not sent: the system refused.
  std::uint64_t queue_peak = 0;  ///< Most datagrams that ever waited.
};

/// The same, counted by several threads.
class LinkCounters {
 public:
  enum Counter : std::uint8_t {
    kReceived,
    kReceivedBytes,
    kOwn,
    kOtherChannel,
    kTooShort,
    kTooLong,
    kFragments,
    kForeign,
    kNoChannel,
    kRefusedFormat,
    kRefusedMission,
    kRefusedTag,
    kRefusedExcluded,
    kQueueFull,
    kKernelDropped,
    kMissing,
    kSent,
    kSentBytes,
    kSendRefused,
    kFailed,
    kCount
  };
  void add(Counter counter, std::uint64_t amount = 1) noexcept {
    values_[counter].fetch_add(amount, std::memory_order_relaxed);
  }
  void set(Counter counter, std::uint64_t value) noexcept {
    values_[counter].store(value, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t operator[](Counter counter) const noexcept {
    return values_[counter].load(std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t> values_[kCount] = {};
};

}  // namespace tessera
