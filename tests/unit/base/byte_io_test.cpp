// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers in byte buffers: little-endian on every machine, and a buffer that ends too early is
// noticed, never overrun.
#include "tessera/base/internal/byte_io.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <limits>

#include "support/random.hpp"

namespace tessera {
namespace {

constexpr bool little_endian_layout() {
  std::array<std::byte, 15> buffer{};
  ByteWriter writer(buffer);
  writer.u8(0x01);
  writer.u16(0x0302);
  writer.u32(0x07060504U);
  writer.u64(0x0f0e0d0c0b0a0908U);
  for (std::size_t i = 0; i < buffer.size(); ++i) {
    if (buffer[i] != static_cast<std::byte>(i + 1)) return false;
  }
  return writer.ok() && writer.size() == buffer.size();
}
static_assert(little_endian_layout(), "the least significant byte comes first");

TEST_CASE("ByteWriter: a float is written as its IEEE bits") {
  std::array<std::byte, 4> buffer{};
  ByteWriter writer(buffer);
  writer.f32(-2.0F);
  CHECK(buffer == std::array{std::byte{0}, std::byte{0}, std::byte{0}, std::byte{0xc0}});
}

TEST_CASE("ByteWriter and ByteReader: what was written is read back, to the bit") {
  constexpr std::uint64_t kSeed = 1;
  INFO("seed " << kSeed);
  oracle::Random random(kSeed);
  for (int round = 0; round < 1000; ++round) {
    const std::uint64_t bits = random.bits();
    const auto i32 = static_cast<std::int32_t>(static_cast<std::uint32_t>(bits));
    const double f64 = random.uniform(-1e9, 1e9);
    std::array<std::byte, 31> buffer{};
    ByteWriter writer(buffer);
    writer.u8(static_cast<std::uint8_t>(bits));
    writer.u16(static_cast<std::uint16_t>(bits));
    writer.u32(static_cast<std::uint32_t>(bits));
    writer.u64(bits);
    writer.i32(i32);
    writer.f32(static_cast<float>(f64));
    writer.f64(f64);
    REQUIRE(writer.ok());
    ByteReader reader(writer.written());
    REQUIRE(reader.u8() == static_cast<std::uint8_t>(bits));
    REQUIRE(reader.u16() == static_cast<std::uint16_t>(bits));
    REQUIRE(reader.u32() == static_cast<std::uint32_t>(bits));
    REQUIRE(reader.u64() == bits);
    REQUIRE(reader.i32() == i32);
    REQUIRE(std::bit_cast<std::uint32_t>(reader.f32()) ==
            std::bit_cast<std::uint32_t>(static_cast<float>(f64)));
    REQUIRE(std::bit_cast<std::uint64_t>(reader.f64()) == std::bit_cast<std::uint64_t>(f64));
    REQUIRE(reader.ok());
    REQUIRE(reader.remaining() == 0);
  }
}

TEST_CASE("ByteWriter and ByteReader: negative and extreme integers keep their sign") {
  for (const std::int32_t value : {-1, std::numeric_limits<std::int32_t>::min(),
                                   std::numeric_limits<std::int32_t>::max(), 0}) {
    std::array<std::byte, 4> buffer{};
    ByteWriter writer(buffer);
    writer.i32(value);
    CHECK(ByteReader(buffer).i32() == value);
  }
}

TEST_CASE("ByteWriter and ByteReader: infinities, NaN and negative zero keep their bits") {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float value :
       {kInfinity, -kInfinity, std::numeric_limits<float>::quiet_NaN(), -0.0F}) {
    std::array<std::byte, 4> buffer{};
    ByteWriter writer(buffer);
    writer.f32(value);
    CHECK(std::bit_cast<std::uint32_t>(ByteReader(buffer).f32()) ==
          std::bit_cast<std::uint32_t>(value));
  }
}

TEST_CASE("ByteWriter: a number fits a buffer of its size or larger, not one a byte smaller") {
  std::array<std::byte, 9> buffer{};
  for (const std::size_t bytes : {7U, 8U, 9U}) {
    ByteWriter writer(std::span<std::byte>(buffer).first(bytes));
    writer.u64(1);
    CHECK(writer.ok() == (bytes >= 8));
    CHECK(writer.size() == (bytes >= 8 ? 8U : 0U));
  }
}

TEST_CASE("ByteWriter: a number that does not fit leaves the bytes before and behind it alone") {
  std::array<std::byte, 8> buffer{};
  buffer.fill(std::byte{0xee});
  ByteWriter writer(std::span<std::byte>(buffer).first(6));
  writer.u32(0);
  writer.u32(0);
  CHECK_FALSE(writer.ok());
  CHECK(writer.written().size() == 4);
  for (std::size_t i = 4; i < buffer.size(); ++i) CHECK(buffer[i] == std::byte{0xee});
}

TEST_CASE("ByteWriter: once something was dropped, ok stays false") {
  std::array<std::byte, 2> buffer{};
  ByteWriter writer(buffer);
  writer.u32(0);
  writer.u16(0);
  CHECK_FALSE(writer.ok());
}

TEST_CASE("ByteReader: a number cut short reads as zero and is noticed") {
  std::array<std::byte, 8> buffer{};
  buffer.fill(std::byte{0xff});
  for (std::size_t bytes = 0; bytes < 8; ++bytes) {
    ByteReader reader(std::span<const std::byte>(buffer).first(bytes));
    CHECK(reader.u64() == 0);
    CHECK_FALSE(reader.ok());
  }
}

TEST_CASE("ByteReader: after the end everything reads as zero, also what would still have fitted") {
  std::array<std::byte, 3> buffer{};
  buffer.fill(std::byte{0xff});
  ByteReader reader(buffer);
  CHECK(reader.u32() == 0);
  CHECK(reader.u8() == 0);
  CHECK(reader.remaining() == 0);
  CHECK_FALSE(reader.ok());
}

TEST_CASE("ByteReader: reading up to the last byte is no failure") {
  std::array<std::byte, 4> buffer{};
  ByteReader reader(buffer);
  CHECK(reader.u32() == 0);
  CHECK(reader.ok());
}

}  // namespace
}  // namespace tessera
