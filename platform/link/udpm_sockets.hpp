// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sockets of an LCM network: one for sending, one that receives from the group, both bound to
// one interface independent of the routes. Neither ever blocks.
#pragma once

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "base/file_descriptor.hpp"
#include "base/network_interface.hpp"
#include "base/outcome.hpp"
#include "link/sender_table.hpp"
#include "link/udpm_url.hpp"

namespace tessera {

/// The address of an LCM network, for both sockets; text: the URL as given, for messages.
struct UdpmPlace {
  const UdpmUrl& url;
  const std::string& text;
  const NetworkInterface& interface;
};

struct UdpmSender {
  FileDescriptor socket;
  Endpoint self{};  ///< As seen by receivers.
};
/// whole_packets: refuses datagrams longer than the interface's MTU, instead of fragmenting them.
/// Fails with kFailure iff the system refuses.
Outcome<UdpmSender> open_udpm_sender(const UdpmPlace& place, bool whole_packets);

struct UdpmReceiver {
  FileDescriptor socket;
  int buffer_bytes = 0;  ///< Granted by the system, including its own overhead.
};
/// at_any_price: requests the buffer beyond the machine's limit, which needs CAP_NET_ADMIN; without
/// that the limit applies. Fails with kFailure iff the system refuses.
Outcome<UdpmReceiver> open_udpm_receiver(const UdpmPlace& place, bool at_any_price);

/// The named interface, or the one of the routes if name is empty. Fails as find_interface and
/// route_interface.
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
  std::uint32_t dropped = 0;  ///< By the kernel before it, in total, if it reports that; else 0.
};
/// Returns the total number of datagrams that the kernel has dropped at a receiver's socket before
/// this message; 0 if the message does not say.
[[nodiscard]] std::uint32_t dropped_by_kernel(const msghdr& message) noexcept;
/// Takes the oldest waiting datagram of a receiver's socket. One system call, no heap.
[[nodiscard]] UdpmDatagram receive_datagram(int socket, std::span<std::byte> into) noexcept;

}  // namespace tessera
