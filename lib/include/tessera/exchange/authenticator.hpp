// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How the exchange tags what it sends and checks what it receives, without knowing any
// cryptography: two functions that the program gives it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/internal/crc32.hpp"

namespace tessera {

inline constexpr std::size_t kTagBytes = 16;

/// Both functions are called with context, from the exchange's thread only, and return in a time
/// that depends only on the message's length. context must outlive whoever holds this.
struct Authenticator {
  void* context = nullptr;
  /// Fills tag for the message.
  void (*tag)(void* context, std::span<const std::byte> message,
              std::span<std::byte, kTagBytes> tag) noexcept = nullptr;
  /// True iff tag is what the function above would fill in.
  bool (*check)(void* context, std::span<const std::byte> message,
                std::span<const std::byte, kTagBytes> tag) noexcept = nullptr;
};

namespace detail {

inline void crc_tag(void* /*context*/, std::span<const std::byte> message,
                    std::span<std::byte, kTagBytes> tag) noexcept {
  const std::uint32_t crc = crc32c(message);
  for (std::size_t i = 0; i < kTagBytes; ++i)
    tag[i] = i < 4 ? static_cast<std::byte>((crc >> (8 * i)) & 0xffU) : std::byte{0};
}

inline bool crc_check(void* context, std::span<const std::byte> message,
                      std::span<const std::byte, kTagBytes> tag) noexcept {
  std::array<std::byte, kTagBytes> wanted{};
  crc_tag(context, message, wanted);
  std::byte difference{0};
  for (std::size_t i = 0; i < kTagBytes; ++i) difference |= wanted[i] ^ tag[i];
  return difference == std::byte{0};
}

}  // namespace detail

/// For a fleet without a key: finds damage, stops nobody. The tag is the CRC-32C of the message,
/// little-endian in the first four bytes, and twelve zeros.
[[nodiscard]] constexpr Authenticator crc_authenticator() noexcept {
  return {nullptr, &detail::crc_tag, &detail::crc_check};
}

}  // namespace tessera
