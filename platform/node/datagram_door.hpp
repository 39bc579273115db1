// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node's link refuses before it takes a place in the queue: whoever has no key of the fleet
// cannot keep out those who have one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "lcm/datagram_link.hpp"
#include "lcm/status_message.hpp"
#include "posix/latest_value.hpp"
#include "tessera/exchange/authenticator.hpp"
#include "tessera/exchange/exchange_config.hpp"

namespace tessera {

/// The exchange's own first checks, in its order: size, header, tag, who is excluded. The exchange
/// makes them once more, as it trusts no caller; of a datagram that is taken that costs its tag a
/// second time.
class DatagramDoor {
 public:
  /// authenticator: as the exchange has it; status: as statuses are sealed. Their checks must do
  /// for two threads at once.
  explicit DatagramDoor(const Authenticator& authenticator, const StatusKeys& status = {}) noexcept
      : authenticator_(authenticator), status_(status) {}

  /// Refuses what these robots send from now on, and no others. For one thread, which need not be
  /// the link's. robots: at most ExchangeConfig::kMostExcluded. No heap.
  void set_excluded(std::span<const std::uint32_t> robots) noexcept;
  /// O(datagram): what is no datagram of the exchange costs its header alone.
  [[nodiscard]] PayloadVerdict judge(std::span<const std::byte> datagram) const noexcept;
  /// The same of a status: size and kind, then the tag, then who is excluded.
  [[nodiscard]] PayloadVerdict judge_status_of(std::span<const std::byte> status) const noexcept;
  /// For the link. This must outlive it and stay where it is.
  [[nodiscard]] PayloadCheck check() noexcept;
  [[nodiscard]] PayloadCheck status_check() noexcept;

 private:
  struct Excluded {
    std::array<std::uint32_t, ExchangeConfig::kMostExcluded> robots{};
    std::uint32_t count = 0;
  };
  [[nodiscard]] bool is_excluded(std::uint32_t robot) const noexcept;

  Authenticator authenticator_;
  StatusKeys status_;
  LatestValue<Excluded> excluded_;
};

}  // namespace tessera
