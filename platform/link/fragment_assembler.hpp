// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Assembles long LCM messages, in memory that is allocated at the start, for any input. A fragment
// is written only where its message has room for it; a message is returned only if its fragments
// cover it exactly, each byte once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "link/long_message.hpp"
#include "link/sender_table.hpp"
#include "tessera/base/counters.hpp"

namespace tessera {

struct AssemblerConfig {
  static constexpr std::size_t kMostSlots = 64;

  std::size_t slots = 4;                      ///< Incomplete messages, 1 .. kMostSlots.
  std::size_t max_message_bytes = 4U << 20U;  ///< Bytes of payload, 1 .. 2^30.
  std::size_t max_fragments = 4096;           ///< Of a message, 1 .. 65,535.
  std::int64_t timeout_us = 200'000;  ///< Without a fragment; then the message may be replaced.
};

#define TESSERA_ASSEMBLER_COUNTERS(ROW)                                                            \
  ROW(COUNTER, uint64_t, taken, "Fragments taken.")                                                \
  ROW(COUNTER, uint64_t, malformed, "Fragments that are malformed.")                               \
  ROW(COUNTER, uint64_t, too_large,                                                                \
      "Fragments of a message of more bytes or fragments than configured.")                        \
  ROW(COUNTER, uint64_t, inconsistent,                                                             \
      "Fragments with other numbers than their message's first, or than the one of their number "  \
      "before.")                                                                                   \
  ROW(COUNTER, uint64_t, duplicates,                                                               \
      "Fragments that are repeated, or of a message that is complete already.")                    \
  ROW(COUNTER, uint64_t, messages, "Messages that are complete.")                                  \
  ROW(COUNTER, uint64_t, torn, "Messages whose fragments all arrived, but overlap or leave gaps.") \
  ROW(COUNTER, uint64_t, timed_out, "Messages replaced after the timeout without a fragment.")     \
  ROW(COUNTER, uint64_t, superseded,                                                               \
      "Messages whose sender began two more: LCM sends one after the other.")                      \
  ROW(COUNTER, uint64_t, evicted, "Messages replaced before their timeout: more slots are needed.")

/// What became of every fragment, and of every begun message. None ever decreases.
struct AssemblerReport {
  TESSERA_ASSEMBLER_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(AssemblerReport, TESSERA_ASSEMBLER_COUNTERS(TESSERA_COUNTER_ROW))

/// A new message takes, in this order: a free slot; that of a message that has timed out; the one
/// that was silent for longest. A sender with two incomplete messages first gives up the older, so
/// that no sender takes all slots.
class FragmentAssembler {
 public:
  struct Message {
    std::string_view channel{};  ///< Empty: none is complete yet. These two are valid until the
                                 ///< next call of take().
    std::span<const std::byte> payload{};
  };

  /// Clamps numbers to their ranges. The only use of the heap: slots * (max_message_bytes + 8 *
  /// max_fragments) bytes and a little.
  explicit FragmentAssembler(const AssemblerConfig& config);

  /// Bytes that a constructor with config allocates on the heap.
  [[nodiscard]] static std::size_t required_bytes(const AssemblerConfig& config) noexcept;

  /// Takes a datagram that begins with "LC03"; returns the message that it completes, if any.
  /// now_us: monotonic, microseconds. O(slots + bytes), and O(max_fragments) for the first fragment
  /// of a message and for the last.
  [[nodiscard]] Message take(const Endpoint& sender, std::span<const std::byte> datagram,
                             std::int64_t now_us) noexcept;

  [[nodiscard]] const AssemblerReport& report() const noexcept { return report_; }

 private:
  static constexpr std::size_t kMostOfSender = 2;

  /// Place of a fragment in its message; no bytes: it has not arrived.
  struct Part {
    std::uint32_t offset = 0;
    std::uint32_t bytes = 0;
  };
  enum class Stage : std::uint8_t { kEmpty, kUnderWay, kDone };
  struct Slot {
    Stage stage = Stage::kEmpty;
    Endpoint sender{};
    std::uint32_t sequence = 0;
    std::uint32_t message_bytes = 0;
    std::uint16_t fragments = 0;
    std::uint16_t taken = 0;
    std::int64_t last_us = 0;  ///< Arrival of the last fragment.
    std::uint64_t begun = 0;   ///< Rises from message to message.
    std::size_t channel_bytes = 0;
    std::array<char, kMaxChannelBytes> channel{};
    std::span<std::byte> payload{};
    std::span<Part> parts{};
  };

  [[nodiscard]] Slot* find(const Endpoint& sender, std::uint32_t sequence) noexcept;
  [[nodiscard]] Slot& room_for(const Endpoint& sender, std::int64_t now_us) noexcept;
  void begin(Slot& slot, const Endpoint& sender, const Fragment& fragment) noexcept;
  [[nodiscard]] bool add(Slot& slot, const Fragment& fragment) noexcept;
  [[nodiscard]] static bool covers(const Slot& slot) noexcept;

  AssemblerConfig config_;
  std::unique_ptr<std::byte[]> payloads_;
  std::unique_ptr<Part[]> parts_;
  std::unique_ptr<Slot[]> slots_;
  std::uint64_t begun_ = 0;
  AssemblerReport report_;
};

}  // namespace tessera
