// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Counts lost datagrams, by the numbers that senders give their messages.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tessera {

/// The UDP socket of a sender.
struct Endpoint {
  std::uint32_t address = 0;  ///< IPv4, host order.
  std::uint16_t port = 0;
  bool operator==(const Endpoint&) const noexcept = default;
};

/// Stores the last number of up to 64 senders; one more replaces the one that was silent for
/// longest. LCM numbers all messages of a sender, on all channels.
class SenderTable {
 public:
  static constexpr std::size_t kSenders = 64;

  /// Number of messages of sender that are missing before this one: 0 for a new sender, for a
  /// number that is not ahead (late, repeated, a fragment of the same message), and for a jump of
  /// more than 2^20 (a restarted sender). O(kSenders).
  std::uint32_t missing_before(const Endpoint& sender, std::uint32_t sequence) noexcept {
    Entry* oldest = &entries_[0];
    for (Entry& entry : entries_) {
      if (entry.last_heard != 0 && entry.sender == sender) return advance(entry, sequence);
      if (entry.last_heard < oldest->last_heard) oldest = &entry;
    }
    *oldest = {sender, sequence, ++now_};
    return 0;
  }
  /// The same for a sender of an earlier call of missing_before(); 0 for others, which take no
  /// place. O(kSenders).
  std::uint32_t missing_if_known(const Endpoint& sender, std::uint32_t sequence) noexcept {
    for (Entry& entry : entries_) {
      if (entry.last_heard != 0 && entry.sender == sender) return advance(entry, sequence);
    }
    return 0;
  }

 private:
  static constexpr std::int32_t kMaxLeap = 1 << 20;
  struct Entry {
    Endpoint sender{};
    std::uint32_t sequence = 0;
    std::uint64_t last_heard = 0;  ///< 0: free.
  };

  std::uint32_t advance(Entry& entry, std::uint32_t sequence) noexcept {
    entry.last_heard = ++now_;
    const auto step = static_cast<std::int32_t>(sequence - entry.sequence);
    const bool late = step <= 0 && step > -kMaxLeap;
    if (!late) entry.sequence = sequence;
    return step > 1 && step < kMaxLeap ? static_cast<std::uint32_t>(step - 1) : 0;
  }

  std::array<Entry, kSenders> entries_{};
  std::uint64_t now_ = 0;
};

}  // namespace tessera
