// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What was lost on the way, by the numbers that senders give their messages.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tessera {

/// A UDP socket of somebody.
struct Endpoint {
  std::uint32_t address = 0;  ///< IPv4, host order.
  std::uint16_t port = 0;
  bool operator==(const Endpoint&) const noexcept = default;
};

/// Remembers the last number of up to 64 senders; one more takes the place of the one that was
/// silent for longest. LCM numbers all messages of a sender, whatever their channel.
class SenderTable {
 public:
  static constexpr std::size_t kSenders = 64;

  /// How many messages of sender are missing before this one: none for a sender that is new, for
  /// a number that is not ahead (late, twice, a fragment of the same message), and for a leap of
  /// more than 2^20 (a sender that started again). O(kSenders).
  std::uint32_t missing_before(const Endpoint& sender, std::uint32_t sequence) noexcept {
    Entry* oldest = &entries_[0];
    for (Entry& entry : entries_) {
      if (entry.last_heard != 0 && entry.sender == sender) return advance(entry, sequence);
      if (entry.last_heard < oldest->last_heard) oldest = &entry;
    }
    *oldest = {sender, sequence, ++now_};
    return 0;
  }
  /// The same of a sender that missing_before() was called with; of others none, and they take no
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
