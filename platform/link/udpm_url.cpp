// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/udpm_url.hpp"

#include <charconv>
#include <optional>

#include "link/short_message.hpp"

namespace tessera {
namespace {

constexpr std::string_view kScheme = "udpm://";

std::optional<std::uint32_t> number(std::string_view text, std::uint32_t low, std::uint32_t high) {
  std::uint32_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stopped != end || value < low || value > high) return std::nullopt;
  return value;
}

/// Cuts off and returns what is before separator; all of it if there is none.
std::string_view take_until(std::string_view& text, char separator) {
  const std::size_t at = text.find(separator);
  const std::string_view before = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + 1);
  return before;
}

std::optional<std::uint32_t> ipv4(std::string_view text) {
  std::uint32_t address = 0;
  for (int part = 0; part < 4; ++part) {
    const std::optional<std::uint32_t> byte = number(take_until(text, '.'), 0, 255);
    if (!byte) return std::nullopt;
    address = address << 8U | *byte;
  }
  if (!text.empty()) return std::nullopt;
  return address;
}

Failure bad_url(std::string_view text, std::string_view reason) {
  return {"cannot use the LCM URL " + one_line(text) + ": " + std::string(reason) +
          "; write it in full, as " + kDefaultUrl};
}

/// Null if the option is valid, else what is wrong with it.
const char* take_option(std::string_view option, UdpmUrl& url, bool& has_ttl, bool& has_buffer) {
  const std::string_view name = take_until(option, '=');
  if (name == "ttl") {
    const std::optional<std::uint32_t> ttl = number(option, 0, 255);
    if (!ttl || has_ttl) return "ttl must be given once, 0 to 255";
    url.ttl = static_cast<int>(*ttl);
    has_ttl = true;
    return nullptr;
  }
  if (name == "recv_buf_size") {
    const std::optional<std::uint32_t> bytes =
        number(option, kMaxUdpPayloadBytes, std::uint32_t{1} << 30U);
    if (!bytes || has_buffer) return "recv_buf_size must be given at most once, 1408 to 2^30";
    url.receive_buffer_bytes = static_cast<int>(*bytes);
    has_buffer = true;
    return nullptr;
  }
  return "its options are ttl and recv_buf_size";
}

}  // namespace

Outcome<UdpmUrl> UdpmUrl::parse(std::string_view text) {
  std::string_view rest = text;
  if (!rest.starts_with(kScheme)) return bad_url(text, "only udpm:// crosses a network");
  rest.remove_prefix(kScheme.size());
  std::string_view place = take_until(rest, '?');
  UdpmUrl url;
  const std::optional<std::uint32_t> group = ipv4(take_until(place, ':'));
  if (!group || *group >> 28U != 14U) {
    return bad_url(text, "its group must be an address from 224.0.0.0 to 239.255.255.255");
  }
  const std::optional<std::uint32_t> port = number(place, 1, 65535);
  if (!port) return bad_url(text, "its port must be 1 to 65535");
  url.group = *group;
  url.port = static_cast<std::uint16_t>(*port);
  bool has_ttl = false;
  bool has_buffer = false;
  while (!rest.empty()) {
    const char* const fault = take_option(take_until(rest, '&'), url, has_ttl, has_buffer);
    if (fault != nullptr) return bad_url(text, fault);
  }
  if (!has_ttl) {
    return bad_url(text, "it has no ttl (0: this machine only, 1: this network)");
  }
  return url;
}

std::string address_text(std::uint32_t address) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) {
    text += std::to_string(address >> static_cast<unsigned>(shift) & 0xffU);
    if (shift > 0) text += '.';
  }
  return text;
}

}  // namespace tessera
