// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Worst-case duration of a frame on the bus. A sender inserts a bit of the other kind after every
// five equal ones, and that bit may be the first of the next five: so n bits get at most (n - 1) /
// 4 more (ISO 11898-1; a test reaches the bound).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

/// SOF, identifier, RTR, IDE, r0, length, CRC.
inline constexpr std::uint32_t kClassicStuffedBits = 1 + 11 + 1 + 1 + 1 + 4 + 15;
/// CRC delimiter, acknowledge and its delimiter, end of frame, and the pause before the next frame.
inline constexpr std::uint32_t kUnstuffedBits = 1 + 1 + 1 + 7 + 3;

/// Bits of a CAN 2.0 frame with an 11-bit identifier and bytes of data, with worst-case stuffing.
[[nodiscard]] constexpr std::uint32_t worst_classic_bits(std::uint32_t bytes) noexcept {
  const std::uint32_t stuffed = kClassicStuffedBits + 8 * bytes;
  return stuffed + (stuffed - 1) / 4 + kUnstuffedBits;
}

struct FdBits {
  std::uint32_t nominal = 0;  ///< At the bit rate of arbitration.
  std::uint32_t data = 0;     ///< At the faster one.
};

/// The same for CAN FD with an 11-bit identifier and a faster bit rate for data. The CRC has 17
/// bits up to 16 bytes and 21 beyond; with the four of the stuff count before it, a fixed bit is
/// inserted before it and after every four of its bits.
[[nodiscard]] constexpr FdBits worst_fd_bits(std::uint32_t bytes) noexcept {
  // SOF, identifier, RRS, IDE, FDF, res, BRS.
  constexpr std::uint32_t kArbitration = 1 + 11 + 1 + 1 + 1 + 1 + 1;
  // ESI, length.
  const std::uint32_t data = 1 + 4 + 8 * bytes;
  constexpr std::uint32_t kSlowStuff = (kArbitration - 1) / 4;
  const std::uint32_t stuff = (kArbitration + data - 1) / 4;
  const std::uint32_t check = 4 + (bytes <= 16 ? 17U : 21U);
  const std::uint32_t fixed = (check + 3) / 4;
  return {.nominal = kArbitration + kSlowStuff + kUnstuffedBits,
          .data = data + (stuff - kSlowStuff) + check + fixed};
}

/// The time of worst_fd_bits in bits of the slower rate. ratio: faster by slower rate.
[[nodiscard]] constexpr double worst_fd_nominal_bits(std::uint32_t bytes, double ratio) noexcept {
  const FdBits bits = worst_fd_bits(bytes);
  return bits.nominal + bits.data / ratio;
}

}  // namespace tessera
