// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "view/listen_address.hpp"

#include <arpa/inet.h>
#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <optional>

namespace tessera {

namespace {

/// "host:port", "[host]:port"; the port may be missing if none is needed.
struct Parts {
  std::string_view host;
  std::optional<std::uint16_t> port;
  bool bracketed = false;
};

std::optional<std::uint16_t> port_of(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return port;
}

std::optional<Parts> parts_of(std::string_view text) {
  Parts parts;
  std::size_t end = 0;
  if (text.starts_with('[')) {
    end = text.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    parts.host = text.substr(1, end - 1);
    parts.bracketed = true;
    ++end;
  } else {
    end = std::min(text.find(':'), text.size());
    parts.host = text.substr(0, end);
  }
  if (end == text.size()) return parts;
  parts.port = text[end] == ':' ? port_of(text.substr(end + 1)) : std::nullopt;
  if (!parts.port) return std::nullopt;
  return parts;
}

bool is_localhost(std::string_view host) {
  constexpr std::string_view kName = "localhost";
  return std::equal(host.begin(), host.end(), kName.begin(), kName.end(), [](char a, char b) {
    return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
  });
}

/// Only IPv6 addresses are in brackets.
bool read_ip(const Parts& parts, sockaddr_storage& into) {
  const std::string host(parts.host);
  if (parts.bracketed) {
    sockaddr_in6 address{};
    address.sin6_family = AF_INET6;
    if (::inet_pton(AF_INET6, host.c_str(), &address.sin6_addr) != 1) return false;
    *reinterpret_cast<sockaddr_in6*>(&into) = address;
    return true;
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  if (::inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1) return false;
  *reinterpret_cast<sockaddr_in*>(&into) = address;
  return true;
}

}  // namespace

bool ListenAddress::is_loopback() const {
  if (is_ipv6()) {
    const auto& address = reinterpret_cast<const sockaddr_in6&>(socket).sin6_addr;
    return IN6_IS_ADDR_LOOPBACK(&address);
  }
  const auto& address = reinterpret_cast<const sockaddr_in&>(socket).sin_addr;
  return (ntohl(address.s_addr) >> 24U) == 127U;
}

std::string ListenAddress::url(std::uint16_t bound_port) const {
  return fmt::format("http://{}:{}/", (is_ipv6() ? "[" + host + "]" : host), bound_port);
}

Outcome<ListenAddress> parse_listen_address(std::string_view text) {
  std::optional<Parts> parts = parts_of(text);
  if (parts && !parts->bracketed && is_localhost(parts->host)) parts->host = "127.0.0.1";
  ListenAddress address;
  if (!parts || !parts->port || !read_ip(*parts, address.socket)) {
    return Failure{
        one_line(text) +
        " is not an address with a port; give numbers such as 127.0.0.1:8080 or [::1]:8080, "
        "with port 0 for any free one"};
  }
  address.host = std::string(parts->host);
  address.port = *parts->port;
  const std::uint16_t port = htons(address.port);
  if (address.is_ipv6()) {
    reinterpret_cast<sockaddr_in6&>(address.socket).sin6_port = port;
  } else {
    reinterpret_cast<sockaddr_in&>(address.socket).sin_port = port;
  }
  return address;
}

bool is_trusted_host(std::string_view host) {
  const std::optional<Parts> parts = parts_of(host);
  if (!parts) return false;
  if (!parts->bracketed && is_localhost(parts->host)) return true;
  sockaddr_storage unused{};
  return read_ip(*parts, unused);
}

}  // namespace tessera
