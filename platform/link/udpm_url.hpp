// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The address of an LCM network, in the form of all LCM programs, but complete: what LCM would
// choose by itself (a random address, a ttl) must be given.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/outcome.hpp"

namespace tessera {

inline constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=4194304";

/// udpm://GROUP:PORT?ttl=N[&recv_buf_size=BYTES].
struct UdpmUrl {
  std::uint32_t group = 0;  ///< IPv4, host order; a multicast address.
  std::uint16_t port = 0;
  int ttl = 0;  ///< 0: this machine only, 1: this network.
  int receive_buffer_bytes = 4 << 20;

  /// Fails with kUsage iff text is not a URL of this form, the group is not a multicast address
  /// (224.0.0.0 to 239.255.255.255), the port is 0, ttl is missing or not 0 to 255, or the buffer
  /// is not 1,408 to 2^30 bytes, or an option is unknown or given twice.
  static Outcome<UdpmUrl> parse(std::string_view text);
};

/// "239.255.76.67". address: host order.
[[nodiscard]] std::string address_text(std::uint32_t address);

}  // namespace tessera
