// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sockets of an LCM network: one to send from, one that hears the group, both bound to one
// interface whatever the routes say. Neither ever blocks.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>

#include "lcm/sender_table.hpp"
#include "lcm/udpm_url.hpp"
#include "posix/file_descriptor.hpp"
#include "posix/network_interface.hpp"
#include "posix/outcome.hpp"

namespace tessera {

/// Where an LCM network is, for both sockets; text: the URL as it was given, for messages.
struct UdpmPlace {
  const UdpmUrl& url;
  const std::string& text;
  const NetworkInterface& interface;
};

struct UdpmSender {
  FileDescriptor socket;
  Endpoint self{};  ///< As receivers see it.
};
/// whole_packets: what is longer than the interface's MTU is refused rather than cut. Fails with
/// kFailure iff the system refuses.
Outcome<UdpmSender> open_udpm_sender(const UdpmPlace& place, bool whole_packets);

struct UdpmReceiver {
  FileDescriptor socket;
  int buffer_bytes = 0;  ///< What the system granted, which it counts with its own overhead.
};
/// at_any_price: asks for the buffer beyond the machine's limit, which takes CAP_NET_ADMIN; without
/// it the limit holds. Fails with kFailure iff the system refuses.
Outcome<UdpmReceiver> open_udpm_receiver(const UdpmPlace& place, bool at_any_price);

/// The interface that is named, or what the routes choose where name is empty. Fails as
/// find_interface and route_interface.
Outcome<NetworkInterface> udpm_interface(const std::string& name, const UdpmUrl& url);

/// How many datagrams the kernel has dropped before a message, where the message tells; else 0.
[[nodiscard]] std::uint32_t dropped_by_kernel(msghdr& message) noexcept;

}  // namespace tessera
