// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Bits as bytes, each at the cost of how unlikely it was: a binary range coder on 32-bit integers.
// All decisions together are one number in [0, 1), of which no more bytes are written than tell it
// from every other sequence of decisions.
//
// Of the numbers that mean the same, the code is the one with the most zero bits at its end; those
// of its bytes are left out, and the decoder reads zeros there. So a sequence of decisions has one
// code, and a decoder can tell whether bytes are that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

namespace detail {

inline constexpr unsigned kProbabilityBits = 12;
/// Below this a byte is settled, and the range grows by its eight bits.
inline constexpr std::uint32_t kLeastRange = std::uint32_t{1} << 24U;

/// From low to the next number whose lower bits are all zero.
[[nodiscard]] constexpr std::uint32_t to_next_byte(std::uint32_t low) noexcept {
  return (0U - low) & (kLeastRange - 1);
}
[[nodiscard]] constexpr std::uint32_t to_next_word(std::uint32_t low) noexcept { return 0U - low; }

}  // namespace detail

/// How likely a bit is one, learnt from the bits that came before: in units of 2^-16, moved by a
/// part of what it was off. Never 0 or 1.
class Probability {
 public:
  constexpr Probability() noexcept = default;
  /// initial: 1 .. 255, in units of 1 / 256.
  explicit constexpr Probability(std::uint8_t initial) noexcept
      : value_(static_cast<std::uint16_t>(initial << 8U)) {}

  /// In units of 2^-12, 1 .. 4095.
  [[nodiscard]] constexpr std::uint32_t one() const noexcept {
    const std::uint32_t upper = value_ >> kSpareBits;
    return upper != 0 ? upper : 1;
  }
  constexpr void learn(bool bit) noexcept {
    const std::uint32_t value = value_;
    const std::uint32_t moved =
        bit ? value + ((kWhole - value) >> kRate) : value - (value >> kRate);
    value_ = static_cast<std::uint16_t>(moved);
  }

 private:
  static constexpr unsigned kRate = 4;
  static constexpr unsigned kSpareBits = 16 - detail::kProbabilityBits;
  static constexpr std::uint32_t kWhole = 65536;
  std::uint16_t value_ = kWhole / 2;
};

/// Writes decisions of ones and zeros by their probabilities.
class RangeEncoder {
 public:
  explicit constexpr RangeEncoder(std::span<std::byte> into) noexcept : into_(into) {}

  /// one: the probability of a one in units of 2^-12, 1 .. 4095. O(1), and O(bytes so far) where a
  /// carry goes through bytes of 255, which each do once.
  constexpr void encode(bool bit, std::uint32_t one) noexcept {
    const std::uint32_t bound = (range_ >> detail::kProbabilityBits) * one;
    if (bit) {
      range_ = bound;
    } else {
      low_ += bound;
      range_ -= bound;
    }
    while (range_ < detail::kLeastRange) {
      put_top_byte();
      range_ <<= 8U;
    }
  }
  /// Bytes that were settled so far, whether or not there was room for them.
  [[nodiscard]] constexpr std::size_t settled() const noexcept { return size_; }
  /// Ends the code; only once. Returns its bytes, at least 1: 0 iff into had no room for all of
  /// them, those counted that are zero and left out at the end.
  [[nodiscard]] constexpr std::size_t finish() noexcept {
    const auto low = static_cast<std::uint32_t>(low_);
    if (detail::to_next_word(low) < range_) {
      low_ += detail::to_next_word(low);
      if (low_ != 0 && size_ <= into_.size()) carry();
    } else {
      low_ += detail::to_next_byte(low);
      put_top_byte();
    }
    if (size_ == 0) put_top_byte();
    if (size_ > into_.size()) return 0;
    while (size_ > 1 && into_[size_ - 1] == std::byte{0}) --size_;
    return size_;
  }

 private:
  constexpr void put_top_byte() noexcept {
    if ((low_ >> 32U) != 0 && size_ <= into_.size()) carry();
    if (size_ < into_.size()) into_[size_] = static_cast<std::byte>((low_ >> 24U) & 0xffU);
    ++size_;
    low_ = (low_ << 8U) & 0xffffffffU;
  }
  /// Adds one to the number that the bytes are; it stays below one.
  constexpr void carry() noexcept {
    std::size_t i = size_;
    do {
      --i;
      into_[i] = static_cast<std::byte>(std::to_integer<unsigned>(into_[i]) + 1U);
    } while (into_[i] == std::byte{0});
  }

  std::span<std::byte> into_;
  std::size_t size_ = 0;
  std::uint64_t low_ = 0;  ///< Below 2^33: the 33rd bit is the carry.
  std::uint32_t range_ = 0xffffffffU;
};

/// Reads what RangeEncoder wrote, with the same probabilities in the same order.
class RangeDecoder {
 public:
  explicit constexpr RangeDecoder(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) offset_ = offset_ << 8U | next();
    // No code begins so, and from here on the offset is in the range.
    if (offset_ >= range_) bytes_ = {};
  }

  /// The bit that was encoded with the same probability, if the bytes are a code; else any. O(1).
  [[nodiscard]] constexpr bool decode(std::uint32_t one) noexcept {
    const std::uint32_t bound = (range_ >> detail::kProbabilityBits) * one;
    const bool bit = offset_ < bound;
    if (bit) {
      range_ = bound;
    } else {
      offset_ -= bound;
      low_ += bound;
      range_ -= bound;
    }
    while (range_ < detail::kLeastRange) {
      offset_ = offset_ << 8U | next();
      low_ <<= 8U;
      range_ <<= 8U;
    }
    return bit;
  }
  /// Bytes that RangeEncoder had settled at this place.
  [[nodiscard]] constexpr std::size_t settled() const noexcept { return read_ - 4; }
  /// True iff the bytes are what RangeEncoder gives for the bits decoded so far. O(1).
  [[nodiscard]] constexpr bool at_end() const noexcept {
    const std::size_t size = bytes_.size();
    if (size == 0 || size > read_ || (size > 1 && bytes_[size - 1] == std::byte{0})) return false;
    const std::uint32_t word = detail::to_next_word(low_);
    return offset_ == (word < range_ ? word : detail::to_next_byte(low_));
  }

 private:
  [[nodiscard]] constexpr std::uint32_t next() noexcept {
    const std::size_t i = read_++;
    return i < bytes_.size() ? std::to_integer<std::uint32_t>(bytes_[i]) : 0U;
  }

  std::span<const std::byte> bytes_;
  std::size_t read_ = 0;
  std::uint32_t offset_ = 0;  ///< Of the code from low, in the window of four bytes.
  std::uint32_t low_ = 0;     ///< As the encoder's, without what it had settled.
  std::uint32_t range_ = 0xffffffffU;
};

}  // namespace tessera
