// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What became of every datagram that reached a link or left it: one counter for each outcome. None
// ever decreases.
#pragma once

#include <atomic>
#include <cstdint>

#include "tessera/base/counters.hpp"

namespace tessera {

#define TESSERA_LINK_COUNTERS(ROW)                                                             \
  ROW(COUNTER, uint64_t, received, "Received, or waiting for receive().")                      \
  ROW(COUNTER, uint64_t, received_bytes, "Their payload.")                                     \
  ROW(COUNTER, uint64_t, own, "Sent by this link, received again and ignored.")                \
  ROW(COUNTER, uint64_t, other_channel, "LCM messages that are not for this link.")            \
  ROW(COUNTER, uint64_t, too_short, "No room for LCM's header, or no payload.")                \
  ROW(COUNTER, uint64_t, too_long, "Over 1,408 bytes; only these were read.")                  \
  ROW(COUNTER, uint64_t, fragments, "Parts of long LCM messages; never assembled.")            \
  ROW(COUNTER, uint64_t, foreign, "Not an LCM message.")                                       \
  ROW(COUNTER, uint64_t, no_channel, "Channel name empty, too long or unterminated.")          \
  ROW(COUNTER, uint64_t, refused_format, "On the channel, but not of its format.")             \
  ROW(COUNTER, uint64_t, refused_mission, "Of another mission.")                               \
  ROW(COUNTER, uint64_t, refused_tag, "Damaged, or from a sender without the key.")            \
  ROW(COUNTER, uint64_t, refused_excluded, "Of an excluded sender.")                           \
  ROW(COUNTER, uint64_t, queue_full,                                                           \
      "Lost here: call receive() more often, or use more queue_slots.")                        \
  ROW(COUNTER, uint64_t, kernel_dropped, "Lost before this link: use a larger recv_buf_size.") \
  ROW(COUNTER, uint64_t, missing, "Lost on the network, by the numbers of their senders.")     \
  ROW(COUNTER, uint64_t, sent, "Datagrams sent.")                                              \
  ROW(COUNTER, uint64_t, sent_bytes, "Their payload.")                                         \
  ROW(COUNTER, uint64_t, refused, "Not sent: empty, too long, or no channel.")                 \
  ROW(COUNTER, uint64_t, failed, "Not sent: the system refused.")                              \
  ROW(LEVEL, uint64_t, queue_peak, "Most datagrams that ever waited.")

struct LinkReport {
  TESSERA_LINK_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(LinkReport, TESSERA_LINK_COUNTERS(TESSERA_COUNTER_ROW))

/// The same, counted by several threads.
class LinkCounters {
 public:
  using Counter = std::atomic<std::uint64_t>;
#define TESSERA_SHARED_COUNTER(kind, type, name, sentence) Counter name{0};
  TESSERA_LINK_COUNTERS(TESSERA_SHARED_COUNTER)
#undef TESSERA_SHARED_COUNTER

  static void add(Counter& counter, std::uint64_t amount = 1) noexcept {
    counter.fetch_add(amount, std::memory_order_relaxed);
  }
  [[nodiscard]] LinkReport report() const noexcept {
#define TESSERA_READ_COUNTER(kind, type, name, sentence) \
  .name = name.load(std::memory_order_relaxed),
    return {TESSERA_LINK_COUNTERS(TESSERA_READ_COUNTER)};
#undef TESSERA_READ_COUNTER
  }
};

}  // namespace tessera
