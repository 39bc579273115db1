// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Refuses datagrams before they take a place in the queue of a node's link: a sender without a key
// of the fleet cannot displace those with one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/latest_value.hpp"
#include "link/datagram_link.hpp"
#include "link/status_message.hpp"
#include "tessera/exchange/authenticator.hpp"
#include "tessera/exchange/exchange_config.hpp"

namespace tessera {

/// The first checks of the exchange, in its order: size, header, mission, tag, exclude list. The
/// exchange repeats them, as it trusts no caller; for an accepted datagram this checks the tag a
/// second time.
class DatagramDoor {
 public:
  /// authenticator, mission: those of the exchange; status: the keys of statuses. Their checks must
  /// be safe for two threads at once.
  explicit DatagramDoor(const Authenticator& authenticator, const StatusKeys& status = {},
                        std::uint32_t mission = 0) noexcept
      : authenticator_(authenticator), status_(status), mission_(mission) {}

  /// Sets the excluded robots. For one thread, which need not be that of the link. robots: at most
  /// ExchangeConfig::kMostExcluded. No heap.
  void set_excluded(std::span<const std::uint32_t> robots) noexcept;
  /// O(datagram); O(1) for what is not a datagram of the exchange.
  [[nodiscard]] PayloadVerdict judge(std::span<const std::byte> datagram) const noexcept;
  /// The same for a status: size and kind, then the tag, then the exclude list.
  [[nodiscard]] PayloadVerdict judge_status_of(std::span<const std::byte> status) const noexcept;
  /// For the link, which this must outlive, at the same address.
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
  std::uint32_t mission_;
  LatestValue<Excluded> excluded_;
};

}  // namespace tessera
