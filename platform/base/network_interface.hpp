// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The network interface for multicast: the named one, or the one of the routes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/outcome.hpp"

namespace tessera {

struct NetworkInterface {
  std::string name;
  int index = 0;
  std::uint32_t address = 0;  ///< IPv4, host order; the first one it has.
  int mtu_bytes = 0;
  bool is_up = false;
  bool is_loopback = false;
  bool can_multicast = false;
};

/// name: of an interface ("eth0"), or an IPv4 address that one has. Fails with kUsage iff no
/// interface with an IPv4 address has that name or address. Uses the heap.
Outcome<NetworkInterface> find_interface(std::string_view name);

/// The interface of the machine's routes for group (IPv4, host order). Fails with kFailure
/// iff there is no route to it. Sends nothing. Uses the heap.
Outcome<NetworkInterface> route_interface(std::uint32_t group);

}  // namespace tessera
