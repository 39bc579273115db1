// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads numbers in LCM's encoding from the front of a message.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace tessera {

class BigEndianReader {
 public:
  explicit BigEndianReader(std::span<const std::byte> bytes) noexcept : rest_(bytes) {}

  [[nodiscard]] std::size_t left() const noexcept { return rest_.size(); }

  /// A caller bug unless left() is at least the size of Word, here and below.
  template <class Word>
  [[nodiscard]] Word word() noexcept {
    const Word value = read<Word>(rest_.data());
    rest_ = rest_.subspan(sizeof(Word));
    return value;
  }
  [[nodiscard]] std::int32_t i32() noexcept {
    return static_cast<std::int32_t>(word<std::uint32_t>());
  }
  [[nodiscard]] std::int64_t i64() noexcept {
    return static_cast<std::int64_t>(word<std::uint64_t>());
  }
  [[nodiscard]] double f64() noexcept { return std::bit_cast<double>(word<std::uint64_t>()); }

  void floats(std::span<float> into) noexcept {
    for (std::size_t i = 0; i < into.size(); ++i)
      into[i] = std::bit_cast<float>(read<std::uint32_t>(rest_.data() + 4 * i));
    rest_ = rest_.subspan(into.size_bytes());
  }
  void bytes(std::span<std::uint8_t> into) noexcept {
    if (!into.empty()) std::memcpy(into.data(), rest_.data(), into.size());
    rest_ = rest_.subspan(into.size());
  }

 private:
  template <class Word>
  [[nodiscard]] static Word read(const std::byte* from) noexcept {
    Word value{};
    std::memcpy(&value, from, sizeof value);
    if constexpr (std::endian::native == std::endian::big) return value;
    if constexpr (sizeof(Word) == 8) return __builtin_bswap64(value);
    if constexpr (sizeof(Word) == 4) return __builtin_bswap32(value);
    if constexpr (sizeof(Word) == 2) return __builtin_bswap16(value);
  }

  std::span<const std::byte> rest_;
};

}  // namespace tessera
