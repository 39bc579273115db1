// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A number within the data of a frame, as in a DBC file: little-endian ("Intel"); the start is the
// place of its lowest bit, bit 0 is the lowest of byte 0.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace tessera {

struct Signal {
  const char* name = "";
  std::uint16_t start = 0;  ///< See above; start + length is at most 8 * the message's bytes.
  std::uint8_t length = 0;  ///< Bits, 1 to 32.
  bool is_signed = false;
  double scale = 1.0;  ///< The value is raw * scale + offset.
  double offset = 0.0;
  double least = 0.0;  ///< Of the value; codes beyond most have special meanings.
  double most = 0.0;
  const char* unit = "";
  std::int8_t sector = -1;  ///< Number of the sector; its name in the DBC begins with that.

  [[nodiscard]] constexpr std::uint32_t mask() const noexcept {
    return length >= 32 ? ~std::uint32_t{0} : (std::uint32_t{1} << length) - 1;
  }
};

/// Writes the low bits of raw to the signal. Does nothing iff it is not completely within data.
constexpr void put_raw(std::span<std::uint8_t> data, const Signal& signal,
                       std::uint32_t raw) noexcept {
  const unsigned first = signal.start;
  if (first + signal.length > 8 * data.size()) return;
  for (unsigned i = 0; i < signal.length; ++i) {
    std::uint8_t& byte = data[(first + i) / 8];
    const unsigned bit = 1U << ((first + i) % 8);
    const bool set = ((raw >> i) & 1U) != 0;
    byte = static_cast<std::uint8_t>(set ? byte | bit : byte & ~bit);
  }
}

/// The signal's bits, without sign extension; 0 iff they are not all within data.
[[nodiscard]] constexpr std::uint32_t raw_of(std::span<const std::uint8_t> data,
                                             const Signal& signal) noexcept {
  const unsigned first = signal.start;
  if (first + signal.length > 8 * data.size()) return 0;
  std::uint32_t raw = 0;
  for (unsigned i = 0; i < signal.length; ++i)
    raw |= ((std::uint32_t{data[(first + i) / 8]} >> ((first + i) % 8)) & 1U) << i;
  return raw;
}

/// Writes the nearest valid value; clamps to least and most, NaN becomes least.
inline void put_value(std::span<std::uint8_t> data, const Signal& signal, double value) noexcept {
  const double bounded = value > signal.least ? std::min(value, signal.most) : signal.least;
  const auto raw =
      static_cast<std::int64_t>(std::llround((bounded - signal.offset) / signal.scale));
  put_raw(data, signal, static_cast<std::uint32_t>(raw));
}

/// Any code, in range or not.
[[nodiscard]] inline double value_of(std::span<const std::uint8_t> data,
                                     const Signal& signal) noexcept {
  auto raw = static_cast<std::int64_t>(raw_of(data, signal));
  const bool negative = signal.is_signed && ((raw >> (signal.length - 1)) & 1) != 0;
  if (negative) raw -= std::int64_t{1} << signal.length;
  return static_cast<double>(raw) * signal.scale + signal.offset;
}

/// True if a value is in the signal's range. Half a step is for rounding.
[[nodiscard]] inline bool in_range(const Signal& signal, double value) noexcept {
  return value >= signal.least - 0.5 * signal.scale && value <= signal.most + 0.5 * signal.scale;
}

}  // namespace tessera
