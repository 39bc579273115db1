// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers as stored in clouds: integers and floats of 1 to 8 bytes, in either byte order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tessera {

enum class NumberKind : std::uint8_t { kSigned, kUnsigned, kFloat };

struct StoredNumber {
  NumberKind kind = NumberKind::kFloat;
  std::uint8_t bytes = 4;  ///< 1, 2, 4 or 8; a float 4 or 8.
  bool is_big_endian = false;

  /// Reads `bytes` bytes, which must exist. Exact up to 2^53.
  [[nodiscard]] double load(const char* from) const noexcept;
  /// An integer as it is, a float if it is whole and under 2^53. False iff it is not a whole
  /// number.
  [[nodiscard]] bool load_whole(const char* from, std::int64_t& value) const noexcept;
};

/// value as an integer, iff it is one that a double holds exactly.
[[nodiscard]] bool as_whole(double value, std::int64_t& whole) noexcept;

/// Decimal digits only. False iff word is anything else, or more than 64 bits hold.
[[nodiscard]] bool parse_count(std::string_view word, std::uint64_t& value) noexcept;

}  // namespace tessera
