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
constexpr std::array<std::uint32_t, 256> make_crc32_table() noexcept {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t value = i;
    for (int bit = 0; bit < 8; ++bit)
      value = (value >> 1U) ^ ((value & 1U) != 0 ? 0x82f63b78U : 0U);
    table[i] = value;
  }
  return table;
}
inline constexpr std::array<std::uint32_t, 256> kCrc32Table = make_crc32_table();
}  // namespace detail

/// The checksum of bytes; previous continues an earlier call's value. O(size).
constexpr std::uint32_t crc32c(std::span<const std::byte> bytes,
                               std::uint32_t previous = 0) noexcept {
  std::uint32_t crc = ~previous;
  for (const std::byte b : bytes) {
    crc = (crc >> 8U) ^ detail::kCrc32Table[(crc ^ static_cast<std::uint32_t>(b)) & 0xffU];
  }
  return ~crc;
}

}  // namespace tessera
