// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "lcm/datagram_link.hpp"

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

}  // namespace

Outcome<void> DatagramLink::open_sender() {
  sender_ = FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  ip_mreqn by{};
  by.imr_ifindex = interface_.index;
  const sockaddr_in own = place_of(interface_.address, 0);
  const sockaddr_in group = place_of(url_.group, url_.port);
  const bool opened = sender_.is_open() &&                                         //
                      set_option(sender_, IPPROTO_IP, IP_MULTICAST_IF, by) &&      //
                      set_option(sender_, IPPROTO_IP, IP_MULTICAST_TTL, url_.ttl)  //
                      && set_option(sender_, IPPROTO_IP, IP_MULTICAST_LOOP, 1) &&  //
                      // Rather an error here than fragments, of which one lost loses all.
                      set_option(sender_, IPPROTO_IP, IP_MTU_DISCOVER, int{IP_PMTUDISC_DO}) &&
                      ::bind(sender_.get(), generic(own), sizeof own) == 0 &&
                      ::connect(sender_.get(), generic(group), sizeof group) == 0;
  sockaddr_in named{};
  socklen_t bytes = sizeof named;
  if (!opened || ::getsockname(sender_.get(), reinterpret_cast<sockaddr*>(&named), &bytes) != 0) {
    return Failure{"cannot send to " + config_.url + " by " + interface_.name + ": " +
                       std::strerror(errno) + "; tessera doctor says how to mend it",
                   FailureKind::kFailure};
  }
  self_ = {ntohl(named.sin_addr.s_addr), ntohs(named.sin_port)};
  return {};
}

Outcome<void> DatagramLink::open_receiver() {
  receiver_ = FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  ip_mreqn member{};
  member.imr_multiaddr.s_addr = htonl(url_.group);
  member.imr_ifindex = interface_.index;
  const sockaddr_in group = place_of(url_.group, url_.port);
  const bool opened =
      receiver_.is_open() &&  //
      // Other LCM programs of this machine have the same address.
      set_option(receiver_, SOL_SOCKET, SO_REUSEADDR, 1) &&
      set_option(receiver_, SOL_SOCKET, SO_RCVBUF, url_.receive_buffer_bytes) &&
      set_option(receiver_, SOL_SOCKET, SO_RXQ_OVFL, 1) &&
      // Only what comes by the interface that was chosen, whatever others of this machine joined.
      set_option(receiver_, IPPROTO_IP, IP_MULTICAST_ALL, 0) &&
      ::bind(receiver_.get(), generic(group), sizeof group) == 0 &&
      set_option(receiver_, IPPROTO_IP, IP_ADD_MEMBERSHIP, member);
  socklen_t bytes = sizeof receive_buffer_bytes_;
  if (!opened ||
      ::getsockopt(receiver_.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes_, &bytes) != 0) {
    return Failure{"cannot receive from " + config_.url + " by " + interface_.name + ": " +
                       std::strerror(errno) + "; tessera doctor says how to mend it",
                   FailureKind::kFailure};
  }
  return {};
}

}  // namespace tessera
