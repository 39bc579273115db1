// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the page is served: "127.0.0.1:8080", "[::1]:8080".
#pragma once

#include <netinet/in.h>

#include <string>
#include <string_view>

#include "posix/outcome.hpp"

namespace tessera {

struct ListenAddress {
  std::string host;        ///< An IP address as numbers, without brackets.
  std::uint16_t port = 0;  ///< 0: any that is free.
  sockaddr_storage socket{};

  [[nodiscard]] bool is_ipv6() const { return socket.ss_family == AF_INET6; }
  /// Whether nobody outside of this machine can reach it.
  [[nodiscard]] bool is_loopback() const;
  /// As in a browser's address line, with this port.
  [[nodiscard]] std::string url(std::uint16_t bound_port) const;
};

/// Names are not looked up, but "localhost" is 127.0.0.1. Fails with kUsage iff text is no address
/// with a port in 0 .. 65535; the message begins with text.
Outcome<ListenAddress> parse_listen_address(std::string_view text);

/// What a browser may write into Host: an IP address as numbers, or localhost, and perhaps a port.
/// A page of elsewhere, whose name is made to mean this machine (DNS rebinding), comes with its
/// name. The port may be another one, as of a tunnel.
[[nodiscard]] bool is_trusted_host(std::string_view host);

}  // namespace tessera
