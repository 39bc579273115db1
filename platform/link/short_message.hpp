// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// LCM messages of one datagram, byte by byte: "LC02", a sequence number (big-endian), the channel's
// name, a zero, the payload. Messages of several datagrams ("LC03") are only recognised: only
// sensors of the same machine may send them (long_message.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace tessera {

inline constexpr std::size_t kShortHeaderBytes = 8;
/// Most bytes of channel, zero and payload: with IP, UDP and LCM headers 1,436 bytes, which fit
/// into one Ethernet frame.
inline constexpr std::size_t kMaxMessageBytes = 1400;
inline constexpr std::size_t kMaxUdpPayloadBytes = kShortHeaderBytes + kMaxMessageBytes;
/// The IPv4 packet of that, which a network must carry without fragmenting it.
inline constexpr std::size_t kMaxIpPacketBytes = kMaxUdpPayloadBytes + 28;
/// Limit of LCM, without the zero.
inline constexpr std::size_t kMaxChannelBytes = 63;

enum class MessageKind : std::uint8_t {
  kShort,
  kFragment,   ///< Part of a long message; only its sequence number is read.
  kTooShort,   ///< No room for a header.
  kTooLong,    ///< More than kMaxUdpPayloadBytes.
  kForeign,    ///< Not a magic number of LCM.
  kNoChannel,  ///< No zero within the first 64 bytes after the header, or an empty name.
};

struct ReceivedMessage {
  MessageKind kind = MessageKind::kTooShort;
  std::uint32_t sequence = 0;  ///< With kShort and kFragment.
  std::string_view channel{};  ///< With kShort; these two point into the datagram.
  std::span<const std::byte> payload{};
};

namespace detail {

inline constexpr std::uint32_t kShortMagic = 0x4c433032U;
inline constexpr std::uint32_t kFragmentMagic = 0x4c433033U;

constexpr std::uint32_t read_big_endian(std::span<const std::byte> bytes) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i)
    value = value << 8U | std::to_integer<std::uint32_t>(bytes[i]);
  return value;
}

constexpr void write_big_endian(std::uint32_t value, std::span<std::byte> bytes) noexcept {
  for (std::size_t i = 0; i < 4; ++i)
    bytes[i] = static_cast<std::byte>((value >> (24U - 8U * i)) & 0xffU);
}

}  // namespace detail

/// datagram: any UDP payload, of any length. Never returns kTooLong. Reads at most its first 72
/// bytes.
[[nodiscard]] inline ReceivedMessage read_whole_message(
    std::span<const std::byte> datagram) noexcept {
  if (datagram.size() < kShortHeaderBytes) return {MessageKind::kTooShort};
  const std::uint32_t magic = detail::read_big_endian(datagram);
  const std::uint32_t sequence = detail::read_big_endian(datagram.subspan(4));
  if (magic == detail::kFragmentMagic) return {MessageKind::kFragment, sequence};
  if (magic != detail::kShortMagic) return {MessageKind::kForeign};
  const std::span<const std::byte> rest = datagram.subspan(kShortHeaderBytes);
  std::size_t length = 0;
  while (length < rest.size() && length <= kMaxChannelBytes && rest[length] != std::byte{0})
    ++length;
  if (length == 0 || length == rest.size() || length > kMaxChannelBytes)
    return {MessageKind::kNoChannel};
  const std::string_view channel(reinterpret_cast<const char*>(rest.data()), length);
  return {MessageKind::kShort, sequence, channel, rest.subspan(length + 1)};
}

/// The same, for a network whose messages fit into one Ethernet frame each.
[[nodiscard]] inline ReceivedMessage read_message(std::span<const std::byte> datagram) noexcept {
  if (datagram.size() > kMaxUdpPayloadBytes) return {MessageKind::kTooLong};
  return read_whole_message(datagram);
}

using ShortHeader = std::array<std::byte, kShortHeaderBytes + kMaxChannelBytes + 1>;

/// Writes everything of a message before its payload. channel: 1 to 63 bytes without a zero.
/// Returns the number of bytes.
inline std::size_t write_header(ShortHeader& header, std::uint32_t sequence,
                                std::string_view channel) noexcept {
  detail::write_big_endian(detail::kShortMagic, header);
  detail::write_big_endian(sequence, std::span(header).subspan(4));
  std::memcpy(header.data() + kShortHeaderBytes, channel.data(), channel.size());
  header[kShortHeaderBytes + channel.size()] = std::byte{0};
  return kShortHeaderBytes + channel.size() + 1;
}

}  // namespace tessera
