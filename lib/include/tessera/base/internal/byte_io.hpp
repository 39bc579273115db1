// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Little-endian numbers in byte buffers, whatever the machine's own order.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

/// Writes numbers one after the other into a buffer; what does not fit is dropped and ok() turns
/// false.
class ByteWriter {
 public:
  explicit constexpr ByteWriter(std::span<std::byte> buffer) noexcept : buffer_(buffer) {}
  constexpr void u8(std::uint8_t value) noexcept { put(value, 1); }
  constexpr void u16(std::uint16_t value) noexcept { put(value, 2); }
  constexpr void u32(std::uint32_t value) noexcept { put(value, 4); }
  constexpr void u64(std::uint64_t value) noexcept { put(value, 8); }
  constexpr void i32(std::int32_t value) noexcept { put(static_cast<std::uint32_t>(value), 4); }
  constexpr void f32(float value) noexcept { u32(std::bit_cast<std::uint32_t>(value)); }
  constexpr void f64(double value) noexcept { u64(std::bit_cast<std::uint64_t>(value)); }
  constexpr void bytes(std::span<const std::byte> values) noexcept {
    for (const std::byte value : values) put(std::to_integer<std::uint64_t>(value), 1);
  }
  /// Takes bytes from the end of the room, for what comes after.
  constexpr void keep_free(std::size_t bytes) noexcept {
    buffer_ = buffer_.first(position_ + (room() < bytes ? 0 : room() - bytes));
  }
  [[nodiscard]] constexpr bool ok() const noexcept { return ok_; }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return position_; }
  [[nodiscard]] constexpr std::size_t room() const noexcept { return buffer_.size() - position_; }
  [[nodiscard]] constexpr std::span<const std::byte> written() const noexcept {
    return buffer_.first(position_);
  }

 private:
  constexpr void put(std::uint64_t value, std::size_t bytes) noexcept {
    if (buffer_.size() - position_ < bytes) {
      ok_ = false;
      return;
    }
    for (std::size_t i = 0; i < bytes; ++i) {
      buffer_[position_++] = static_cast<std::byte>((value >> (8 * i)) & 0xffU);
    }
  }
  std::span<std::byte> buffer_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

/// Reads numbers one after the other; beyond the end gives zero and ok() turns false.
class ByteReader {
 public:
  explicit constexpr ByteReader(std::span<const std::byte> buffer) noexcept : buffer_(buffer) {}
  constexpr std::uint8_t u8() noexcept { return static_cast<std::uint8_t>(get(1)); }
  constexpr std::uint16_t u16() noexcept { return static_cast<std::uint16_t>(get(2)); }
  constexpr std::uint32_t u32() noexcept { return static_cast<std::uint32_t>(get(4)); }
  constexpr std::uint64_t u64() noexcept { return get(8); }
  constexpr std::int32_t i32() noexcept { return static_cast<std::int32_t>(u32()); }
  constexpr float f32() noexcept { return std::bit_cast<float>(u32()); }
  constexpr double f64() noexcept { return std::bit_cast<double>(u64()); }
  /// The next so many bytes, where they are; none if there are fewer.
  constexpr std::span<const std::byte> bytes(std::size_t count) noexcept {
    if (remaining() < count) {
      ok_ = false;
      position_ = buffer_.size();
      return {};
    }
    position_ += count;
    return buffer_.subspan(position_ - count, count);
  }
  [[nodiscard]] constexpr bool ok() const noexcept { return ok_; }
  [[nodiscard]] constexpr std::size_t remaining() const noexcept {
    return buffer_.size() - position_;
  }

 private:
  constexpr std::uint64_t get(std::size_t bytes) noexcept {
    if (remaining() < bytes) {
      ok_ = false;
      position_ = buffer_.size();
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      value |= std::to_integer<std::uint64_t>(buffer_[position_++]) << (8 * i);
    }
    return value;
  }
  std::span<const std::byte> buffer_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace tessera
