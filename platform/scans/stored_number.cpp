// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/stored_number.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <system_error>

namespace tessera {
namespace {

/// The bytes as an unsigned number, assembled one by one: correct on every machine, and without
/// alignment.
std::uint64_t load_bits(const char* from, unsigned bytes, bool is_big_endian) noexcept {
  std::uint64_t bits = 0;
  for (unsigned i = 0; i < bytes; ++i) {
    const unsigned place = is_big_endian ? bytes - 1 - i : i;
    bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(from[place])) << (8 * i);
  }
  return bits;
}

std::int64_t with_sign(std::uint64_t bits, unsigned bytes) noexcept {
  const unsigned unused = 64 - 8 * bytes;
  return static_cast<std::int64_t>(bits << unused) >> unused;
}

}  // namespace

double StoredNumber::load(const char* from) const noexcept {
  const std::uint64_t bits = load_bits(from, bytes, is_big_endian);
  if (kind == NumberKind::kSigned) return static_cast<double>(with_sign(bits, bytes));
  if (kind == NumberKind::kUnsigned) return static_cast<double>(bits);
  if (bytes == 8) return std::bit_cast<double>(bits);
  return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
}

bool StoredNumber::load_whole(const char* from, std::int64_t& value) const noexcept {
  if (kind == NumberKind::kFloat) return as_whole(load(from), value);
  // Unsigned 64-bit numbers wrap in the upper half; only their low bits are used.
  const std::uint64_t bits = load_bits(from, bytes, is_big_endian);
  value = kind == NumberKind::kSigned ? with_sign(bits, bytes) : static_cast<std::int64_t>(bits);
  return true;
}

bool as_whole(double value, std::int64_t& whole) noexcept {
  constexpr double kExact = 9007199254740992.0;
  if (!(std::abs(value) < kExact)) return false;
  whole = static_cast<std::int64_t>(value);
  // Written without ==: a whole number has no fraction.
  return !(std::abs(value - static_cast<double>(whole)) > 0.0);
}

bool parse_count(std::string_view word, std::uint64_t& value) noexcept {
  const char* const end = word.data() + word.size();
  const auto [stopped, error] = std::from_chars(word.data(), end, value);
  return error == std::errc{} && stopped == end;
}

}  // namespace tessera
