// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/udpm_sockets.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

namespace tessera {
namespace {

sockaddr_in place_of(std::uint32_t address, std::uint16_t port) {
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_addr.s_addr = htonl(address);
  place.sin_port = htons(port);
  return place;
}

const sockaddr* generic(const sockaddr_in& place) {
  return reinterpret_cast<const sockaddr*>(&place);
}

template <class Value>
bool set_option(const FileDescriptor& socket, int level, int name, const Value& value) {
  return ::setsockopt(socket.get(), level, name, &value, sizeof value) == 0;
}

FileDescriptor new_socket() {
  return FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

Failure refused(const char* what, const UdpmPlace& place) {
  return {std::string("cannot ") + what + place.text + " by " + place.interface.name + ": " +
              std::strerror(errno) + "; run tessera doctor",
          FailureKind::kFailure};
}

}  // namespace

Outcome<NetworkInterface> udpm_interface(const std::string& name, const UdpmUrl& url) {
  return name.empty() ? route_interface(url.group) : find_interface(name);
}

Outcome<UdpmSender> open_udpm_sender(const UdpmPlace& place, bool whole_packets) {
  UdpmSender sender{.socket = new_socket()};
  const FileDescriptor& socket = sender.socket;
  ip_mreqn by{};
  by.imr_ifindex = place.interface.index;
  const sockaddr_in own = place_of(place.interface.address, 0);
  const sockaddr_in group = place_of(place.url.group, place.url.port);
  const int discovery = whole_packets ? IP_PMTUDISC_DO : IP_PMTUDISC_DONT;
  const bool opened = socket.is_open() &&                                              //
                      set_option(socket, IPPROTO_IP, IP_MULTICAST_IF, by) &&           //
                      set_option(socket, IPPROTO_IP, IP_MULTICAST_TTL, place.url.ttl)  //
                      && set_option(socket, IPPROTO_IP, IP_MULTICAST_LOOP, 1) &&       //
                      // An error is better than fragments, of which one lost loses all.
                      set_option(socket, IPPROTO_IP, IP_MTU_DISCOVER, discovery) &&
                      ::bind(socket.get(), generic(own), sizeof own) == 0 &&
                      ::connect(socket.get(), generic(group), sizeof group) == 0;
  sockaddr_in named{};
  socklen_t bytes = sizeof named;
  if (!opened || ::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&named), &bytes) != 0)
    return refused("send to ", place);
  sender.self = {ntohl(named.sin_addr.s_addr), ntohs(named.sin_port)};
  return sender;
}

Outcome<UdpmReceiver> open_udpm_receiver(const UdpmPlace& place, bool at_any_price) {
  UdpmReceiver receiver{.socket = new_socket()};
  const FileDescriptor& socket = receiver.socket;
  const int wanted = place.url.receive_buffer_bytes;
  ip_mreqn member{};
  member.imr_multiaddr.s_addr = htonl(place.url.group);
  member.imr_ifindex = place.interface.index;
  const sockaddr_in group = place_of(place.url.group, place.url.port);
  const bool forced =
      at_any_price && socket.is_open() && set_option(socket, SOL_SOCKET, SO_RCVBUFFORCE, wanted);
  const bool opened =
      socket.is_open() &&  //
                           // Other LCM programs of this machine have the same address.
      set_option(socket, SOL_SOCKET, SO_REUSEADDR, 1) &&
      (forced || set_option(socket, SOL_SOCKET, SO_RCVBUF, wanted)) &&
      set_option(socket, SOL_SOCKET, SO_RXQ_OVFL, 1) &&
      // Only datagrams from the chosen interface, even if other programs joined the
      // group on others.
      set_option(socket, IPPROTO_IP, IP_MULTICAST_ALL, 0) &&
      ::bind(socket.get(), generic(group), sizeof group) == 0 &&
      set_option(socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, member);
  socklen_t bytes = sizeof receiver.buffer_bytes;
  if (!opened ||
      ::getsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &receiver.buffer_bytes, &bytes) != 0)
    return refused("receive from ", place);
  return receiver;
}

std::uint32_t dropped_by_kernel(const msghdr& message) noexcept {
  // The macros do not take a const message; nothing is written.
  msghdr& read = const_cast<msghdr&>(message);
  for (cmsghdr* c = CMSG_FIRSTHDR(&read); c != nullptr; c = CMSG_NXTHDR(&read, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
    std::uint32_t dropped = 0;
    std::memcpy(&dropped, CMSG_DATA(c), sizeof dropped);
    return dropped;
  }
  return 0;
}

UdpmDatagram receive_datagram(int socket, std::span<std::byte> into) noexcept {
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint32_t))> control;
  sockaddr_in from{};
  iovec part{into.data(), into.size()};
  msghdr message{};
  message.msg_name = &from;
  message.msg_namelen = sizeof from;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t count = ::recvmsg(socket, &message, 0);
  using Read = UdpmDatagram::Read;
  if (count < 0) return {.read = errno == EINTR ? Read::kInterrupted : Read::kNothing};
  return {.read = Read::kTaken,
          .bytes = static_cast<std::size_t>(count),
          .is_cut = (message.msg_flags & MSG_TRUNC) != 0,
          .sender = {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)},
          .dropped = dropped_by_kernel(message)};
}

}  // namespace tessera
