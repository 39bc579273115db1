// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How often a node leaves its epoch while another process goes above it each time.
#include "node/epoch_pace.hpp"

#include <catch2/catch.hpp>
#include <vector>

namespace tessera {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;

/// Seconds at which the epoch is changed, with another process above it in [begin_s, end_s).
std::vector<std::int64_t> changes(EpochPace& pace, std::int64_t begin_s, std::int64_t end_s) {
  std::vector<std::int64_t> at_s;
  for (std::int64_t s = begin_s; s < end_s; ++s) {
    if (!pace.may_change(s * kSecond_us)) continue;
    pace.note_change(s * kSecond_us);
    at_s.push_back(s);
  }
  return at_s;
}

TEST_CASE(
    "EpochPace: the first change is at once, each pause twice the one before, up to an hour") {
  EpochPace pace(true);
  CHECK(changes(pace, 100, 16000) ==
        std::vector<std::int64_t>{100, 130, 190, 310, 550, 1030, 1990, 3910, 7510, 11110, 14710});
}

TEST_CASE("EpochPace: after an hour in which nobody was above it, pauses begin as the first") {
  EpochPace pace(true);
  CHECK(changes(pace, 100, 191).size() == 3);  // May change again at 310.
  SECTION("an hour less a second") {
    const std::int64_t s = 310 + 3599;
    CHECK(changes(pace, s, s + 241) == std::vector<std::int64_t>{s, s + 240});
  }
  SECTION("an hour") {
    const std::int64_t s = 310 + 3600;
    CHECK(changes(pace, s, s + 91) == std::vector<std::int64_t>{s, s + 30, s + 90});
  }
}

TEST_CASE("EpochPace: where robots do not sign, what was forged is published over every 10 s") {
  EpochPace pace(false);
  CHECK(changes(pace, 100, 141) == std::vector<std::int64_t>{100, 110, 120, 130, 140});
}

TEST_CASE("EpochPace: a change that failed is tried again after the shortest pause") {
  EpochPace pace(true);
  pace.put_off(100 * kSecond_us);
  CHECK(changes(pace, 100, 161) == std::vector<std::int64_t>{130, 160});
}

}  // namespace
}  // namespace tessera
