// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Layout of an archive file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tessera::archive_format {

inline constexpr std::array<char, 8> kMagic{'T', 'S', 'A', 'R', 'C', '\r', '\n', '\x1a'};
inline constexpr std::uint16_t kMajor = 1;
inline constexpr std::uint16_t kMinor = 0;
/// Magic, versions, bytes of the empty map file that follows, checksum of these.
inline constexpr std::size_t kPreambleBytes = 8 + 2 + 2 + 4 + 4;
inline constexpr std::uint32_t kMostHeaderBytes = 8192;

inline constexpr std::uint32_t kBlockMark = 0x4b434c42U;  // "BLCK"
inline constexpr std::uint32_t kDoneMark = 0x454e4f44U;   // "DONE"
/// Mark, bytes of the payload, key or revision, checksum of these.
inline constexpr std::size_t kHeadBytes = 4 + 4 + 8 + 4;
inline constexpr std::size_t kChecksumBytes = 4;

struct RecordHead {
  std::uint32_t mark = 0;
  std::uint32_t payload_bytes = 0;
  std::uint64_t key = 0;
};

/// Bytes of a record in the file: head, payload, its checksum, zeros up to the next unit.
constexpr std::uint64_t record_bytes(std::uint64_t payload_bytes, std::uint64_t unit) noexcept {
  return (kHeadBytes + payload_bytes + kChecksumBytes + unit - 1) / unit * unit;
}

}  // namespace tessera::archive_format
