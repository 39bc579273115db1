// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// CRC-32C (Castagnoli, reflected 0x82f63b78), the checksum of everything stored or sent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

namespace detail {
using Crc32Tables = std::array<std::array<std::uint32_t, 256>, 8>;

/// Table k: what a byte does to the checksum when k more bytes follow it.
constexpr Crc32Tables make_crc32_tables() noexcept {
  Crc32Tables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit)
      value = (value >> 1U) ^ ((value & 1U) != 0 ? 0x82f63b78U : 0U);
    tables[0][i] = value;
  }
  for (std::size_t k = 1; k < tables.size(); ++k) {
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t before = tables[k - 1][i];
      tables[k][i] = (before >> 8U) ^ tables[0][before & 0xffU];
    }
  }
  return tables;
}
inline constexpr Crc32Tables kCrc32Tables = make_crc32_tables();
}  // namespace detail

/// The checksum of bytes; previous continues an earlier call's value. O(size), eight bytes at once.
constexpr std::uint32_t crc32c(std::span<const std::byte> bytes,
                               std::uint32_t previous = 0) noexcept {
  const detail::Crc32Tables& tables = detail::kCrc32Tables;
  const auto at = [&bytes](std::size_t i) { return std::to_integer<std::uint32_t>(bytes[i]); };
  std::uint32_t crc = ~previous;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    const std::uint32_t low = crc ^ (at(0) | at(1) << 8U | at(2) << 16U | at(3) << 24U);
    crc = tables[7][low & 0xffU] ^ tables[6][(low >> 8U) & 0xffU] ^
          tables[5][(low >> 16U) & 0xffU] ^ tables[4][low >> 24U] ^ tables[3][at(4)] ^
          tables[2][at(5)] ^ tables[1][at(6)] ^ tables[0][at(7)];
  }
  for (const std::byte b : bytes)
    crc = (crc >> 8U) ^ tables[0][(crc ^ static_cast<std::uint32_t>(b)) & 0xffU];
  return ~crc;
}

}  // namespace tessera
