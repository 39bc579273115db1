// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sockets of an LCM network: one to send from, one that hears the group, both bound to one
// interface whatever the routes say. Neither ever blocks.
#pragma once

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <span>
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

struct UdpmDatagram {
  enum class Read : std::uint8_t {
    kNothing,  ///< None waits.
    kInterrupted,
    kTaken,
  };
  Read read = Read::kNothing;
  std::size_t bytes = 0;
  bool is_cut = false;  ///< It was longer than the memory for it.
  Endpoint sender{};
  std::uint32_t dropped = 0;  ///< By the kernel before it, ever, where it tells; else 0.
};
/// Returns how many datagrams the kernel has dropped at a receiver's socket before this message,
/// ever; 0 where the message does not say.
[[nodiscard]] std::uint32_t dropped_by_kernel(const msghdr& message) noexcept;
/// Takes the oldest datagram that waits at a receiver's socket. One system call, no heap.
[[nodiscard]] UdpmDatagram receive_datagram(int socket, std::span<std::byte> into) noexcept;

}  // namespace tessera
