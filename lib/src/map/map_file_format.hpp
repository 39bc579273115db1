// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Constants and the checksummed streams that both halves of the map file share.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>

#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera::detail {

/// The carriage return and line feed catch transfers that rewrite text.
inline constexpr std::array<char, 8> kMapMagic{'T', 'S', 'M', 'A', 'P', '\r', '\n', '\x1a'};
inline constexpr std::uint16_t kMapMajor = 2;
inline constexpr std::uint16_t kMapMinor = 0;
/// In the byte of the tuple policy: probabilities are shares of the counts.
inline constexpr unsigned kSharesBit = 0x80;
/// There too: the map keeps votes.
inline constexpr unsigned kVotesBit = 0x40;
inline constexpr std::size_t kPreambleBytes = 8 + 2 + 2 + 4;
inline constexpr std::uint32_t kEndMark = 0x454e4421U;

/// Bytes of storage that so many items of a size fill, in whole pages.
constexpr std::uint64_t pages_bytes(std::uint64_t items, std::uint64_t item_bytes) noexcept {
  const std::uint64_t per_page = SlabPool::kPageBytes / item_bytes;
  return (items + per_page - 1) / per_page * SlabPool::kPageBytes;
}

/// Bytes of storage that hold a file's content, and a little more; 0 if none can. label_bytes: of a
/// label page. The header tells blocks with labels and with free evidence, but not in how many of
/// their layers: so it is a bound.
constexpr std::size_t storage_for(const MapFileContent& content, std::uint32_t octet_bytes,
                                  std::uint32_t label_bytes) noexcept {
  const auto bytes_of = [&](std::uint64_t label_pages, std::uint64_t free_pages) {
    return pages_bytes(content.blocks, sizeof(Block)) + pages_bytes(label_pages, label_bytes) +
           pages_bytes(free_pages, sizeof(FreePage)) + pages_bytes(content.octets, octet_bytes);
  };
  if (bytes_of(content.label_pages, content.free_pages) > MapConfig::kMaxStorageBytes) return 0;
  const std::uint64_t most = bytes_of(std::min(content.octets, kBlockLayers * content.label_pages),
                                      kBlockLayers * content.free_pages);
  return std::min(static_cast<std::size_t>(most) + 4 * SlabPool::kPageBytes,
                  MapConfig::kMaxStorageBytes);
}

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
