// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Digest and checksum are part of what is stored and compared between machines: the values here are
// fixed for good. A change of one of them means that maps of before and after no longer compare
// equal, and files no longer load.
#include "tessera/base/internal/digest.hpp"

#include <array>
#include <catch2/catch.hpp>

#include "tessera/base/internal/crc32.hpp"

namespace tessera {
namespace {

constexpr std::uint64_t digest_of(std::initializer_list<std::uint64_t> words) {
  Digest digest;
  for (const std::uint64_t word : words) digest.add(word);
  return digest.value();
}

template <std::size_t kSize>
constexpr std::array<std::byte, kSize - 1> text(const char (&letters)[kSize]) {
  std::array<std::byte, kSize - 1> bytes{};
  for (std::size_t i = 0; i + 1 < kSize; ++i) bytes[i] = static_cast<std::byte>(letters[i]);
  return bytes;
}

// mix64 is the output function of splitmix64: the generator seeded with 0 gives this published
// first number.
static_assert(mix64(0x9e3779b97f4a7c15U) == 0xe220a8397b1dcdafU);
static_assert(mix64(0) == 0);

TEST_CASE("Digest: golden values") {
  CHECK(digest_of({}) == 0xb1aa596a80c24b30U);
  CHECK(digest_of({0}) == 0x1d7f193f17d66ea3U);
  CHECK(digest_of({1, 2, 3}) == 0x2d0b62e7221d19dbU);
  CHECK(digest_of({0xffffffffffffffffU}) == 0x2dd9c08ae621c66eU);
}

TEST_CASE("Digest: order counts") { CHECK(digest_of({1, 2}) != digest_of({2, 1})); }

TEST_CASE("Digest: length counts, also of zeros") {
  CHECK(digest_of({}) != digest_of({0}));
  CHECK(digest_of({0}) != digest_of({0, 0}));
}

TEST_CASE("Digest: every single bit of a word counts") {
  const std::uint64_t plain = digest_of({5, 0, 7});
  for (unsigned bit = 0; bit < 64; ++bit)
    CHECK(digest_of({5, std::uint64_t{1} << bit, 7}) != plain);
}

TEST_CASE("Digest: the sign of zero does not count, any other bit of a float does") {
  const auto of = [](float value) {
    Digest digest;
    digest.add_float(value);
    return digest.value();
  };
  CHECK(of(-0.0F) == of(0.0F));
  CHECK(of(1.0F) != of(-1.0F));
  CHECK(of(1.0F) != of(1.0F + 0x1p-23F));
}

TEST_CASE("crc32c: the published check value") {
  static_assert(crc32c(text("123456789")) == 0xe3069283U);
  CHECK(crc32c(text("123456789")) == 0xe3069283U);
}

TEST_CASE("crc32c: the values of RFC 3720 for 32 bytes of zeros, ones, and counting up") {
  std::array<std::byte, 32> bytes{};
  CHECK(crc32c(bytes) == 0x8a9136aaU);
  bytes.fill(std::byte{0xff});
  CHECK(crc32c(bytes) == 0x62a8ab43U);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::byte>(i);
  CHECK(crc32c(bytes) == 0x46dd794eU);
}

TEST_CASE("crc32c: of nothing is zero") { CHECK(crc32c({}) == 0); }

TEST_CASE("crc32c: cut anywhere and continued, gives the value of the whole") {
  constexpr auto kText = text("123456789");
  const std::span<const std::byte> whole(kText);
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    CHECK(crc32c(whole.subspan(cut), crc32c(whole.first(cut))) == 0xe3069283U);
  }
}

TEST_CASE("crc32c: every single flipped bit is noticed") {
  auto bytes = text("123456789");
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    CHECK(crc32c(bytes) != 0xe3069283U);
    bytes[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
  }
}

}  // namespace
}  // namespace tessera
