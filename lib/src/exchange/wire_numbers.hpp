// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How numbers that are mostly small are written in datagrams.
#pragma once

#include <cstdint>
#include <span>

#include "tessera/exchange/wire.hpp"

namespace tessera::wire {

inline constexpr std::size_t kIdBytes = 12;

inline void read_id(ByteReader& from, ContributionId& id) noexcept {
  id.robot = from.u32();
  id.epoch = from.u32();
  id.submap = from.u32();
}

/// Seven bits a byte, the lowest first; the eighth says that more follow.
inline void write_varint(ByteWriter& to, std::uint32_t value) noexcept {
  for (; value >= 0x80U; value >>= 7U) to.u8(static_cast<std::uint8_t>(value | 0x80U));
  to.u8(static_cast<std::uint8_t>(value));
}
/// False iff it is over 32 bits, or longer than it needs to be.
inline bool read_varint(ByteReader& from, std::uint32_t& value) noexcept {
  value = 0;
  for (unsigned shift = 0; shift < 35; shift += 7) {
    const std::uint32_t byte = from.u8();
    if (shift == 28 && byte > 0xfU) return false;
    value |= (byte & 0x7fU) << shift;
    if (byte < 0x80U) return from.ok() && (byte != 0 || shift == 0);
  }
  return false;
}
inline std::size_t varint_bytes(std::uint32_t value) noexcept {
  std::size_t bytes = 1;
  for (; value >= 0x80U; value >>= 7U) ++bytes;
  return bytes;
}
/// Small numbers of either sign to small ones.
inline std::uint32_t zigzag(std::int32_t value) noexcept {
  return (static_cast<std::uint32_t>(value) << 1U) ^ (value < 0 ? ~0U : 0U);
}
inline std::int32_t unzigzag(std::uint32_t value) noexcept {
  return static_cast<std::int32_t>((value >> 1U) ^ (0U - (value & 1U)));
}
/// Numbers that ascend, each less the one before it less one.
inline void write_ascending(ByteWriter& to, std::span<const std::uint32_t> numbers) noexcept {
  std::uint32_t next = 0;
  for (const std::uint32_t number : numbers) {
    write_varint(to, number - next);
    next = number + 1;
  }
}
inline bool read_ascending(ByteReader& from, std::span<std::uint32_t> numbers) noexcept {
  std::uint64_t next = 0;
  for (std::uint32_t& number : numbers) {
    std::uint32_t step = 0;
    if (!read_varint(from, step) || next + step > ~std::uint32_t{0}) return false;
    number = static_cast<std::uint32_t>(next + step);
    next = std::uint64_t{number} + 1;
  }
  return true;
}
inline std::size_t ascending_bytes(std::span<const std::uint32_t> numbers) noexcept {
  std::size_t bytes = 0;
  std::uint32_t next = 0;
  for (const std::uint32_t number : numbers) {
    bytes += varint_bytes(number - next);
    next = number + 1;
  }
  return bytes;
}

constexpr bool is_range(const VersionRange& range) noexcept {
  return range.first >= 1 && range.first <= range.last && range.last <= kLastVersion;
}
constexpr bool is_span(const VersionSpan& span) noexcept {
  return span.width <= 32 && span.first() <= kLastVersion && span.last() <= std::uint64_t{1} << 32U;
}

}  // namespace tessera::wire
