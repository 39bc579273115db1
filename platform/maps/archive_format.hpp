// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Layout of a file of records: an archive, or a map that is kept while it is made.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tessera::archive_format {

using Magic = std::array<char, 8>;
inline constexpr Magic kArchiveMagic{'T', 'S', 'A', 'R', 'C', '\r', '\n', '\x1a'};
inline constexpr Magic kJournalMagic{'T', 'S', 'J', 'R', 'N', '\r', '\n', '\x1a'};
inline constexpr std::uint16_t kMajor = 2;
inline constexpr std::uint16_t kMinor = 0;
/// Magic, versions, bytes of the empty map file that follows, checksum of these.
inline constexpr std::size_t kPreambleBytes = 8 + 2 + 2 + 4 + 4;
inline constexpr std::uint32_t kMostHeaderBytes = 8192;

inline constexpr std::uint32_t kBlockMark = 0x4b434c42U;  // "BLCK"
inline constexpr std::uint32_t kDoneMark = 0x454e4f44U;   // "DONE"
inline constexpr std::uint32_t kNoteMark = 0x45544f4eU;   // "NOTE"
/// Records begin at multiples of it.
inline constexpr std::size_t kUnitBytes = 16;
/// Mark, bytes of the payload, key or revision, checksum of these.
inline constexpr std::size_t kHeadBytes = 4 + 4 + 8 + 4;
inline constexpr std::size_t kChecksumBytes = 4;

/// Bytes of a record in the file: head, payload, its checksum, zeros up to the next unit.
constexpr std::uint64_t record_bytes(std::uint64_t payload_bytes, std::uint64_t unit) noexcept {
  return (kHeadBytes + payload_bytes + kChecksumBytes + unit - 1) / unit * unit;
}

}  // namespace tessera::archive_format
