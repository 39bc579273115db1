// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers as text: what a reader types and reads, and what tells every float from its neighbours.
#include "base/number_text.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

namespace tessera {
namespace {

TEST_CASE("nine digits: short numbers stay short") {
  CHECK(nine_digits(0.0) == "0");
  CHECK(nine_digits(-0.25) == "-0.25");
  CHECK(nine_digits(0.1) == "0.1");
  CHECK(nine_digits(static_cast<double>(0.1F)) == "0.100000001");
  CHECK(nine_digits(1e9) == "1e+09");
  CHECK(nine_digits(-1.5e-7) == "-1.5e-07");
  CHECK(nine_digits(123456789.4) == "123456789");
}

TEST_CASE("nine digits: no number has a text of its own") {
  CHECK(nine_digits(std::numeric_limits<double>::quiet_NaN()) == "nan");
  CHECK(nine_digits(std::numeric_limits<double>::infinity()) == "inf");
  CHECK(nine_digits(-std::numeric_limits<double>::infinity()) == "-inf");
}

TEST_CASE("nine digits: every float comes back as it was") {
  std::mt19937 random(7);
  for (int i = 0; i < 20'000; ++i) {
    const float value = std::ldexp(static_cast<float>(random()) / 4294967296.0F,
                                   static_cast<int>(random() % 200) - 100);
    const std::string text = nine_digits(static_cast<double>(value));
    REQUIRE(std::strtof(text.c_str(), nullptr) == value);
  }
}

TEST_CASE("a float's decimal is the number that was typed") {
  CHECK(decimal_of(0.1F) == 0.1);
  CHECK(decimal_of(250.0F) == 250.0);
  CHECK(text_of(decimal_of(0.3F)) == "0.3");
}

TEST_CASE("bytes: units are powers of 1024, with or without a B") {
  CHECK(parse_bytes("17") == 17);
  CHECK(parse_bytes("2k") == 2048);
  CHECK(parse_bytes("1.5M") == 1'572'864);
  CHECK(parse_bytes("1GB") == std::size_t{1} << 30U);
  for (const char* const refused : {"", "M", "-1M", "1T", "1 M", "nan", "2e15"}) {
    CAPTURE(refused);
    CHECK_FALSE(parse_bytes(refused));
  }
}

TEST_CASE("counted: one is singular, all else plural") {
  CHECK(counted(1, "scan") == "1 scan");
  CHECK(counted(0, "scan") == "0 scans");
  CHECK(counted(2, "scan") == "2 scans");
}

}  // namespace
}  // namespace tessera
