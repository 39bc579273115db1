// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What tells sets of records apart: sums over hashes of their contents, so that a record can be
// added and taken away in any order.
#pragma once

#include <bit>
#include <cstdint>

#include "tessera/base/internal/digest.hpp"
#include "tessera/exchange/signatures.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

/// The sum, modulo 2^64 in each half, over all records. Equal sets have equal fingerprints. Of
/// different sets of honest robots two have equal ones by a chance of 2^-128. A robot that signs
/// its own records can construct such sets of its own contribution (a generalised birthday search
/// over sums), of no other robot's.
struct Fingerprint {
  std::uint64_t low = 0;
  std::uint64_t high = 0;
  constexpr Fingerprint& operator+=(const Fingerprint& other) noexcept {
    low += other.low;
    high += other.high;
    return *this;
  }
  constexpr Fingerprint& operator-=(const Fingerprint& other) noexcept {
    low -= other.low;
    high -= other.high;
    return *this;
  }
  /// 64 bits of it.
  [[nodiscard]] constexpr std::uint64_t folded() const noexcept { return mix64(low + mix64(high)); }
  friend constexpr bool operator==(const Fingerprint&, const Fingerprint&) = default;
};

/// Of one record that is held: its hash, and the layers for which no later version is held.
[[nodiscard]] constexpr Fingerprint fingerprint_of(const RecordHash& hash,
                                                   std::uint8_t live) noexcept {
  return {mix64(hash.low + live), mix64(hash.high + live)};
}

/// The same in 32 bits, in the order of hashes: 28 of the hash, then the live layers.
[[nodiscard]] constexpr std::uint32_t mark_of(const RecordHash& hash, std::uint8_t live) noexcept {
  return static_cast<std::uint32_t>(hash.high >> 36U) << 4U | live;
}
/// The mark of two or more records of one version, in different blocks. live is never 0, so it is
/// told from that of one.
[[nodiscard]] constexpr std::uint32_t mark_of_both(std::uint32_t a, std::uint32_t b) noexcept {
  const auto apart = [](std::uint32_t mark) { return (mark & ~0xfU) + ((mark & 0xfU) << 4U); };
  return apart(a) + apart(b);
}
[[nodiscard]] constexpr bool is_of_several(std::uint32_t mark) noexcept {
  return (mark & 0xfU) == 0;
}

/// Of any bytes, the same on every machine: for fleets without signatures. Not cryptographic.
[[nodiscard]] Hash plain_hash(std::span<const std::byte> message) noexcept;

}  // namespace tessera
