// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The range coder: what goes in comes out, in as many bytes as it should, and bits have one code.
#include "tessera/exchange/internal/range_coder.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

using oracle::Random;

struct Decision {
  bool bit;
  std::uint32_t one;
};

std::vector<Decision> decisions(Random& random, int count, int sharpness) {
  std::vector<Decision> made;
  for (int i = 0; i < count; ++i) {
    std::uint32_t one = 1U + static_cast<std::uint32_t>(random.below(4095));
    if (random.below(8) < sharpness) one = random.below(2) == 0 ? 1 : 4095;
    // Mostly as likely as it is said to be, but not always.
    const bool likely = random.uniform() * 4096.0 < one;
    made.push_back({random.below(50) == 0 ? !likely : likely, one});
  }
  return made;
}

std::vector<std::byte> encoded(const std::vector<Decision>& made) {
  std::vector<std::byte> bytes(2 * made.size() + 8);
  RangeEncoder encoder(bytes);
  for (const Decision& d : made) encoder.encode(d.bit, d.one);
  bytes.resize(encoder.finish());
  return bytes;
}

TEST_CASE("range coder: decisions come out as they went in, and the end is told") {
  Random random(static_cast<std::uint64_t>(GENERATE(range(1, 40))));
  const auto made = decisions(random, random.below(3000), random.below(9));
  const auto bytes = encoded(made);
  double bits = 0.0;
  RangeDecoder decoder(bytes);
  for (const Decision& d : made) {
    REQUIRE(decoder.decode(d.one) == d.bit);
    bits -= std::log2((d.bit ? d.one : 4096.0 - d.one) / 4096.0);
  }
  CHECK(decoder.at_end());
  // A step's whole numbers lose less than 2^-11 of a bit, more only where one is very likely.
  CHECK(static_cast<double>(bytes.size()) <=
        bits / 8.0 + 1.0 + 0.01 * static_cast<double>(made.size()) / 8.0);
}

TEST_CASE("range coder: no other bytes are a code of the same bits") {
  Random random(5);
  for (int round = 0; round < 300; ++round) {
    const auto made = decisions(random, 1 + random.below(40), random.below(9));
    const auto bytes = encoded(made);
    for (int i = 0; i < 40; ++i) {
      std::vector<std::byte> other = bytes;
      if (i == 0) other.push_back(std::byte{0});
      if (i == 1) other.push_back(std::byte{1});
      if (i == 2) other.pop_back();
      if (i > 2)
        other[static_cast<std::size_t>(random.below(static_cast<int>(other.size())))] =
            static_cast<std::byte>(random.below(256));
      RangeDecoder decoder(other);
      bool same = true;
      for (const Decision& d : made) same = decoder.decode(d.one) == d.bit && same;
      if (same && decoder.at_end()) REQUIRE(other == bytes);
    }
  }
}

TEST_CASE("range coder: no decision has the code 0, and bytes that no code begins with are none") {
  std::array<std::byte, 4> bytes{};
  RangeEncoder encoder(bytes);
  CHECK(encoder.finish() == 1);
  CHECK(bytes[0] == std::byte{0});
  CHECK(RangeDecoder(std::span(bytes).first(1)).at_end());
  CHECK_FALSE(RangeDecoder(std::span(bytes).first(0)).at_end());
  CHECK_FALSE(RangeDecoder(std::span(bytes).first(2)).at_end());
  bytes.fill(std::byte{0xff});
  RangeDecoder full(bytes);
  for (int i = 0; i < 100; ++i) static_cast<void>(full.decode(2048));
  CHECK_FALSE(full.at_end());
}

TEST_CASE("range coder: a carry goes through bytes of 255, and stops where there is no room") {
  // Halves of ones and zeros that settle to 0xff.. and then are carried over.
  std::vector<Decision> made(64, {false, 1});
  for (int i = 0; i < 400; ++i) made.push_back({false, static_cast<std::uint32_t>(1 + i % 7)});
  for (int i = 0; i < 64; ++i) made.push_back({i % 3 == 0, 2048});
  const auto bytes = encoded(made);
  RangeDecoder decoder(bytes);
  for (const Decision& d : made) REQUIRE(decoder.decode(d.one) == d.bit);
  CHECK(decoder.at_end());
  for (std::size_t room = 0; room < bytes.size(); ++room) {
    std::vector<std::byte> less(room);
    RangeEncoder encoder(less);
    for (const Decision& d : made) encoder.encode(d.bit, d.one);
    CHECK(encoder.finish() == 0);
  }
}

TEST_CASE("probability: it follows the bits, and is never certain") {
  Probability p;
  CHECK(p.one() == 2048);
  for (int i = 0; i < 1000; ++i) p.learn(true);
  CHECK(p.one() == 4095);
  for (int i = 0; i < 1000; ++i) p.learn(false);
  CHECK(p.one() == 1);
  CHECK(Probability(64).one() == 1024);
}

}  // namespace
}  // namespace tessera
