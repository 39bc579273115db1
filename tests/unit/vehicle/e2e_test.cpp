// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/e2e.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <string_view>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

/// A remainder by long division of polynomials, a bit at a time: data, then width zeros; the start
/// value is added to the first bits.
std::uint32_t remainder_of(const Bytes& bytes, unsigned width, std::uint32_t polynomial,
                           std::uint32_t start) {
  std::vector<bool> bits;
  for (const std::uint8_t byte : bytes)
    for (unsigned i = 8; i-- > 0;) bits.push_back(((byte >> i) & 1U) != 0);
  bits.resize(bits.size() + width);
  for (unsigned i = 0; i < width; ++i)
    if (((start >> (width - 1 - i)) & 1U) != 0) bits[i] = !bits[i];
  for (std::size_t i = 0; i + width < bits.size(); ++i) {
    if (!bits[i]) continue;
    bits[i] = false;
    for (unsigned k = 0; k < width; ++k)
      if (((polynomial >> (width - 1 - k)) & 1U) != 0) bits[i + 1 + k] = !bits[i + 1 + k];
  }
  std::uint32_t rest = 0;
  for (std::size_t i = bits.size() - width; i < bits.size(); ++i)
    rest = rest << 1U | (bits[i] ? 1U : 0U);
  return rest;
}

E2eChecker checker_of(E2eProfile profile, std::uint8_t size, std::uint16_t id = 0x123) {
  return E2eChecker({.profile = profile, .data_id = id, .size = size, .max_delta = 4, .sync = 2});
}

Bytes protected_frame(E2eProfile profile, std::uint8_t counter, std::size_t size = 8,
                      std::uint16_t id = 0x123) {
  Bytes data(size, 0x40);
  e2e_protect(profile, id, counter, data);
  return data;
}

TEST_CASE("crc8, crc16: the published check values") {
  const Bytes digits = bytes_of("123456789");
  CHECK((crc8(digits, 0xff) ^ 0xffU) == 0x4b);  // CRC-8/SAE-J1850
  CHECK(crc8(digits, 0x00) == 0x37);            // The same as profile 1 has it: CRC-8/GSM-A
  CHECK(crc16(digits, 0xffff) == 0x29b1);       // CRC-16/CCITT-FALSE
  CHECK(crc8({}, 0x5a) == 0x5a);
  CHECK(crc16({}, 0xffff) == 0xffff);
}

TEST_CASE("crc8, crc16: the same as by long division") {
  oracle::Random random(7101);
  for (int round = 0; round < 200; ++round) {
    Bytes bytes(static_cast<std::size_t>(1 + random.below(64)));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
    const auto start = static_cast<std::uint16_t>(random.below(65536));
    CHECK(crc8(bytes, static_cast<std::uint8_t>(start)) ==
          remainder_of(bytes, 8, 0x1d, start & 0xffU));
    if (bytes.size() >= 2) CHECK(crc16(bytes, start) == remainder_of(bytes, 16, 0x1021, start));
  }
}

TEST_CASE("e2e_protect: the examples of the AUTOSAR protocol specification") {
  Bytes data(8, 0);
  e2e_protect(E2eProfile::kProfile1, 0x123, 0, data);
  CHECK(data == Bytes{0xcc, 0, 0, 0, 0, 0, 0, 0});
  e2e_protect(E2eProfile::kProfile1, 0x123, 1, data);
  CHECK(data == Bytes{0x91, 1, 0, 0, 0, 0, 0, 0});
  data.assign(8, 0);
  e2e_protect(E2eProfile::kProfile5, 0x1234, 0, data);
  CHECK(data == Bytes{0x1c, 0xca, 0, 0, 0, 0, 0, 0});
  e2e_protect(E2eProfile::kProfile5, 0x1234, 1, data);
  CHECK(data == Bytes{0xcf, 0x8d, 1, 0, 0, 0, 0, 0});
}

TEST_CASE("e2e_protect: of profile 1's second byte the high half is the message's own") {
  Bytes data{0, 0xa0, 1, 2};
  e2e_protect(E2eProfile::kProfile1, 7, 14, data);
  CHECK(data[1] == 0xae);
  Bytes one{0x55};
  e2e_protect(E2eProfile::kProfile1, 7, 14, one);
  CHECK(one == Bytes{0x55});
}

TEST_CASE("e2e_next: profile 1 never says 15") {
  CHECK(e2e_next(E2eProfile::kProfile1, 13) == 14);
  CHECK(e2e_next(E2eProfile::kProfile1, 14) == 0);
  CHECK(e2e_next(E2eProfile::kProfile5, 14) == 15);
  CHECK(e2e_next(E2eProfile::kProfile5, 255) == 0);
}

TEST_CASE("E2eChecker: the first is initial, the next ok, around the counter's end too") {
  for (const E2eProfile profile : {E2eProfile::kProfile1, E2eProfile::kProfile5}) {
    E2eChecker checker = checker_of(profile, 8);
    std::uint8_t counter = 9;
    CHECK(checker.check(protected_frame(profile, counter)) == E2eStatus::kInitial);
    for (int i = 0; i < 600; ++i) {
      counter = e2e_next(profile, counter);
      REQUIRE(checker.check(protected_frame(profile, counter)) == E2eStatus::kOk);
    }
  }
}

TEST_CASE("E2eChecker: up to max_delta some are lost, beyond it the sequence is wrong") {
  for (int step = 0; step < 15; ++step) {
    E2eChecker checker = checker_of(E2eProfile::kProfile1, 8);
    static_cast<void>(checker.check(protected_frame(E2eProfile::kProfile1, 3)));
    const auto counter = static_cast<std::uint8_t>((3 + step) % 15);
    const E2eStatus expected = step == 0   ? E2eStatus::kRepeated
                               : step == 1 ? E2eStatus::kOk
                               : step <= 4 ? E2eStatus::kOkSomeLost
                                           : E2eStatus::kWrongSequence;
    CHECK(checker.check(protected_frame(E2eProfile::kProfile1, counter)) == expected);
    CHECK(is_valid(expected) == (step >= 1 && step <= 4));
  }
}

TEST_CASE("E2eChecker: after a wrong sequence it takes two in sequence before all is well") {
  E2eChecker checker = checker_of(E2eProfile::kProfile1, 8);
  const auto check = [&](std::uint8_t counter) {
    return checker.check(protected_frame(E2eProfile::kProfile1, counter));
  };
  CHECK(check(0) == E2eStatus::kInitial);
  CHECK(check(9) == E2eStatus::kWrongSequence);
  CHECK(check(10) == E2eStatus::kSync);
  CHECK(check(10) == E2eStatus::kRepeated);
  CHECK(check(11) == E2eStatus::kSync);
  CHECK(check(12) == E2eStatus::kOk);
  checker.forget();
  CHECK(check(5) == E2eStatus::kInitial);
}

TEST_CASE("E2eChecker: any damaged bit, the wrong identifier, another length, counter 15") {
  for (const E2eProfile profile : {E2eProfile::kProfile1, E2eProfile::kProfile5}) {
    const std::size_t size = profile == E2eProfile::kProfile1 ? 8 : 48;
    const Bytes good = protected_frame(profile, 2, size);
    for (std::size_t bit = 0; bit < 8 * size; ++bit) {
      Bytes bad = good;
      bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
      E2eChecker checker = checker_of(profile, static_cast<std::uint8_t>(size));
      REQUIRE(checker.check(bad) == E2eStatus::kWrongCrc);
      // It has not moved the counter: the right one is still the first.
      REQUIRE(checker.check(good) == E2eStatus::kInitial);
    }
    E2eChecker other = checker_of(profile, static_cast<std::uint8_t>(size), 0x124);
    CHECK(other.check(good) == E2eStatus::kWrongCrc);
    E2eChecker longer = checker_of(profile, static_cast<std::uint8_t>(size + 1));
    CHECK(longer.check(good) == E2eStatus::kWrongCrc);
    CHECK(longer.check({}) == E2eStatus::kWrongCrc);
  }
  E2eChecker checker = checker_of(E2eProfile::kProfile1, 8);
  CHECK(checker.check(protected_frame(E2eProfile::kProfile1, 15)) == E2eStatus::kWrongCrc);
}

TEST_CASE("E2eChecker: without a profile only the size counts") {
  E2eChecker checker({.profile = E2eProfile::kNone, .size = 3});
  CHECK(checker.check(Bytes{1, 2, 3}) == E2eStatus::kOk);
  CHECK(checker.check(Bytes{1, 2}) == E2eStatus::kWrongCrc);
}

TEST_CASE("E2eStatus: every one has its word") {
  for (std::size_t i = 0; i < kE2eStatuses; ++i)
    CHECK(std::string_view(to_string(static_cast<E2eStatus>(i))) != "invalid");
  CHECK(std::string_view(to_string(static_cast<E2eStatus>(kE2eStatuses))) == "invalid");
}

}  // namespace
}  // namespace tessera
