// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What tests of links share: a link that is open, and somebody who sends it what he likes.
#pragma once

#include <arpa/inet.h>
#include <sys/socket.h>

#include <array>
#include <catch2/catch.hpp>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "link/datagram_link.hpp"
#include "own_network.hpp"

namespace tessera {

using Buffer = std::array<std::byte, kMaxMessageBytes>;

inline std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

inline std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline std::unique_ptr<DatagramLink> open_link(const LinkConfig& config) {
  Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(config);
  INFO(link.failure().text());
  REQUIRE(link.ok());
  return std::move(*link);
}

/// Sends whatever it is given to the group, as any program on the network could.
class Stranger {
 public:
  Stranger() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const in_addr loopback{htonl(INADDR_LOOPBACK)};
    ::setsockopt(socket_.get(), IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback);
  }
  void send(std::string_view datagram) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(7667);
    ::inet_pton(AF_INET, "239.255.76.67", &to.sin_addr);
    const ssize_t sent = ::sendto(socket_.get(), datagram.data(), datagram.size(), 0,
                                  reinterpret_cast<const sockaddr*>(&to), sizeof to);
    REQUIRE(sent == static_cast<ssize_t>(datagram.size()));
  }

 private:
  FileDescriptor socket_;
};

}  // namespace tessera
