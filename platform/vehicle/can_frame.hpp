// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A frame of a CAN bus, independent of its transport. Only data frames with 11-bit identifiers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

inline constexpr std::size_t kMostClassicBytes = 8;
inline constexpr std::size_t kMostCanFdBytes = 64;
inline constexpr std::uint32_t kCanIds = 0x800;  ///< Identifiers are below.

struct CanFrame {
  std::uint32_t id = 0;   ///< Below kCanIds.
  std::uint8_t size = 0;  ///< Bytes of data: up to 8, or up to 64 of CAN FD.
  bool is_fd = false;     ///< CAN FD, with the faster bit rate for its data.
  std::array<std::uint8_t, kMostCanFdBytes> data{};

  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return {data.data(), size < data.size() ? size : data.size()};
  }
};

}  // namespace tessera
