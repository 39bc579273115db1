// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Constants and the checksummed streams that both halves of the map file share.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>

#include "tessera/base/byte_io.hpp"
#include "tessera/base/crc32.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera::detail {

/// The carriage return and line feed catch transfers that rewrite text.
inline constexpr std::array<char, 8> kMapMagic{'T', 'S', 'M', 'A', 'P', '\r', '\n', '\x1a'};
inline constexpr std::uint16_t kMapMajor = 1;
inline constexpr std::uint16_t kMapMinor = 0;
inline constexpr std::size_t kPreambleBytes = 8 + 2 + 2 + 4;
inline constexpr std::uint32_t kEndMark = 0x454e4421U;

/// Writes pieces and keeps their running checksum.
class CheckedSink {
 public:
  explicit CheckedSink(const ByteSink& sink) noexcept : sink_(sink) {}
  void put(std::span<const std::byte> bytes) noexcept {
    crc_ = crc32c(bytes, crc_);
    raw(bytes);
  }
  void put_crc() noexcept {
    std::array<std::byte, 4> bytes{};
    ByteWriter writer(bytes);
    writer.u32(crc_);
    raw(bytes);
    crc_ = 0;
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] std::uint64_t offset() const noexcept { return offset_; }

 private:
  void raw(std::span<const std::byte> bytes) noexcept {
    ok_ = ok_ && sink_.write(sink_.context, bytes);
    offset_ += bytes.size();
  }
  ByteSink sink_;
  std::uint32_t crc_ = 0;
  std::uint64_t offset_ = 0;
  bool ok_ = true;
};

/// Reads pieces and keeps their running checksum.
class CheckedSource {
 public:
  /// window: where bytes are read ahead to; empty: none are, so that the source can be read on.
  CheckedSource(const ByteSource& source, std::uint64_t offset,
                std::span<std::byte> window = {}) noexcept
      : source_(source), window_(window), offset_(offset) {}
  /// False at a premature end.
  [[nodiscard]] bool get(std::span<std::byte> into) noexcept {
    const std::size_t n = window_.empty() ? source_.read(source_.context, into) : take(into);
    offset_ += n;
    if (n != into.size()) return false;
    crc_ = crc32c(into, crc_);
    return true;
  }
  enum class Check { kGood, kBad, kEnd };
  [[nodiscard]] Check check_crc() noexcept {
    const std::uint32_t expected = crc_;
    std::array<std::byte, 4> bytes{};
    if (!get(bytes)) return Check::kEnd;
    crc_ = 0;
    return ByteReader(bytes).u32() == expected ? Check::kGood : Check::kBad;
  }
  /// Of what was given out, not of what was read ahead.
  [[nodiscard]] std::uint64_t offset() const noexcept { return offset_; }

 private:
  std::size_t take(std::span<std::byte> into) noexcept {
    std::size_t taken = 0;
    while (taken < into.size()) {
      if (ahead_.empty()) ahead_ = window_.first(source_.read(source_.context, window_));
      if (ahead_.empty()) break;
      const std::size_t n = std::min(ahead_.size(), into.size() - taken);
      std::memcpy(into.data() + taken, ahead_.data(), n);
      ahead_ = ahead_.subspan(n);
      taken += n;
    }
    return taken;
  }
  ByteSource source_;
  std::span<std::byte> window_;
  std::span<const std::byte> ahead_;
  std::uint64_t offset_;
  std::uint32_t crc_ = 0;
};

}  // namespace tessera::detail
