// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The address at which the page is served: "127.0.0.1:8080", "[::1]:8080".
#pragma once

#include <netinet/in.h>

#include <string>
#include <string_view>

#include "base/outcome.hpp"

namespace tessera {

struct ListenAddress {
  std::string host;        ///< An IP address as numbers, without brackets.
  std::uint16_t port = 0;  ///< 0: any free one.
  sockaddr_storage socket{};

  [[nodiscard]] bool is_ipv6() const { return socket.ss_family == AF_INET6; }
  /// True if only this machine can reach it.
  [[nodiscard]] bool is_loopback() const;
  /// URL for a browser, with this port.
  [[nodiscard]] std::string url(std::uint16_t bound_port) const;
};

/// Names are not looked up, except "localhost", which is 127.0.0.1. Fails with kUsage iff text is
/// not an address with a port in 0 .. 65535; the message begins with text.
Outcome<ListenAddress> parse_listen_address(std::string_view text);

/// True for a valid Host header: an IP address as numbers, or localhost, optionally with a port. A
/// foreign page whose name resolves to this machine (DNS rebinding) sends its name. The port may be
/// another one, as of a tunnel.
[[nodiscard]] bool is_trusted_host(std::string_view host);

}  // namespace tessera
