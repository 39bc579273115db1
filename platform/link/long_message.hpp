// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// LCM messages of several datagrams, byte by byte. Each datagram, a fragment: "LC03", the message's
// number, its size, the place of these bytes in it, the fragment's number and the number of
// fragments (32, 32, 32, 16 and 16 bits, big-endian); then, only in fragment 0, the channel's name
// and a zero; then the bytes. For one machine only: a lost fragment loses the whole message.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "link/short_message.hpp"

namespace tessera {

inline constexpr std::size_t kFragmentHeaderBytes = 20;
/// Most payload of UDP over IPv4.
inline constexpr std::size_t kMostUdpPayloadBytes = 65'507;
/// Limit of LCM: a message with more bytes of channel, zero and payload is fragmented.
inline constexpr std::size_t kMostWholeBytes = 65'499;
/// Of LCM: bytes after the header of each fragment except the last.
inline constexpr std::size_t kFragmentBytes = 65'487;

struct Fragment {
  std::uint32_t sequence = 0;
  std::uint32_t message_bytes = 0;  ///< Of the whole message's payload.
  std::uint32_t offset = 0;         ///< Place of this fragment in it.
  std::uint16_t number = 0;
  std::uint16_t fragments = 0;
  std::string_view channel{};  ///< Only of fragment 0; these two point into the datagram.
  std::span<const std::byte> payload{};
};

/// Why a datagram is not a valid fragment.
enum class FragmentFault : std::uint8_t {
  kNone,
  kTooShort,   ///< No room for a header.
  kForeign,    ///< Another magic number.
  kNumber,     ///< Its number is not below their count, or there are more fragments than bytes.
  kNoChannel,  ///< In fragment 0: no zero within 64 bytes, or an empty name.
  kEmpty,      ///< No payload.
  kOutside,    ///< Reaches beyond the message; fragment 0 not at its beginning.
};

namespace detail {

constexpr std::uint16_t read_big_endian_16(std::span<const std::byte> bytes) noexcept {
  return static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[0]) << 8U |
                                    std::to_integer<unsigned>(bytes[1]));
}

constexpr void write_big_endian_16(std::uint16_t value, std::span<std::byte> bytes) noexcept {
  bytes[0] = static_cast<std::byte>(value >> 8U);
  bytes[1] = static_cast<std::byte>(value & 0xffU);
}

/// Bytes of the name before its zero; 0: there is none of 1 to 63 bytes.
inline std::size_t channel_bytes(std::span<const std::byte> text) noexcept {
  std::size_t length = 0;
  while (length < text.size() && length <= kMaxChannelBytes && text[length] != std::byte{0})
    ++length;
  return length == text.size() || length > kMaxChannelBytes ? 0 : length;
}

}  // namespace detail

/// datagram: any UDP payload. into is valid only with kNone: its numbers are then consistent with
/// each other and with the datagram. Reads at most 84 bytes.
[[nodiscard]] inline FragmentFault read_fragment(std::span<const std::byte> datagram,
                                                 Fragment& into) noexcept {
  if (datagram.size() < kFragmentHeaderBytes) return FragmentFault::kTooShort;
  if (detail::read_big_endian(datagram) != detail::kFragmentMagic) return FragmentFault::kForeign;
  into.sequence = detail::read_big_endian(datagram.subspan(4));
  into.message_bytes = detail::read_big_endian(datagram.subspan(8));
  into.offset = detail::read_big_endian(datagram.subspan(12));
  into.number = detail::read_big_endian_16(datagram.subspan(16));
  into.fragments = detail::read_big_endian_16(datagram.subspan(18));
  into.payload = datagram.subspan(kFragmentHeaderBytes);
  into.channel = {};
  if (into.number >= into.fragments || into.fragments > into.message_bytes)
    return FragmentFault::kNumber;
  if (into.number == 0) {
    const std::size_t length = detail::channel_bytes(into.payload);
    if (length == 0) return FragmentFault::kNoChannel;
    into.channel = {reinterpret_cast<const char*>(into.payload.data()), length};
    into.payload = into.payload.subspan(length + 1);
  }
  if (into.payload.empty()) return FragmentFault::kEmpty;
  const std::uint64_t end = std::uint64_t{into.offset} + into.payload.size();
  const bool inside = end <= into.message_bytes && (into.number > 0 || into.offset == 0);
  return inside ? FragmentFault::kNone : FragmentFault::kOutside;
}

using FragmentHeader = std::array<std::byte, kFragmentHeaderBytes + kMaxChannelBytes + 1>;

/// Writes everything of a fragment before its payload: with the channel (1 to 63 bytes without a
/// zero) if its number is 0. Returns the number of bytes.
inline std::size_t write_fragment_header(FragmentHeader& header,
                                         const Fragment& fragment) noexcept {
  const std::span<std::byte> bytes(header);
  detail::write_big_endian(detail::kFragmentMagic, bytes);
  detail::write_big_endian(fragment.sequence, bytes.subspan(4));
  detail::write_big_endian(fragment.message_bytes, bytes.subspan(8));
  detail::write_big_endian(fragment.offset, bytes.subspan(12));
  detail::write_big_endian_16(fragment.number, bytes.subspan(16));
  detail::write_big_endian_16(fragment.fragments, bytes.subspan(18));
  if (fragment.number != 0) return kFragmentHeaderBytes;
  std::memcpy(header.data() + kFragmentHeaderBytes, fragment.channel.data(),
              fragment.channel.size());
  header[kFragmentHeaderBytes + fragment.channel.size()] = std::byte{0};
  return kFragmentHeaderBytes + fragment.channel.size() + 1;
}

}  // namespace tessera
