// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/submap/submap_cutter.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

constexpr std::int64_t kSecond = 1'000'000;

TEST_CASE("SubmapCutter: a submap ends once its way is as long as that") {
  SubmapCutter cutter({.length_m = 5.0});
  int ends = 0;
  for (int i = 0; i <= 30; ++i) {
    const std::optional<SubmapEnd> end = cutter.note({0.5 * i, 0.0, 0.0}, 0);
    if (!end) continue;
    CHECK(*end == SubmapEnd::kLength);
    CHECK(i % 10 == 0);
    ++ends;
    cutter.begin();
    CHECK(cutter.way_m() == 0.0);
  }
  CHECK(ends == 3);
}

TEST_CASE("SubmapCutter: ways there and back count, standing does not") {
  SubmapCutter cutter({.length_m = 5.0});
  for (int i = 0; i < 1000; ++i) CHECK_FALSE(cutter.note({1.0, 2.0, 3.0}, i * kSecond));
  int scans = 0;
  while (!cutter.note({1.0, 2.0, 3.0 + (scans % 2 == 0 ? 1.0 : 0.0)}, 0)) ++scans;
  CHECK(scans == 4);
}

TEST_CASE("SubmapCutter: who does not begin is told again") {
  SubmapCutter cutter({.length_m = 1.0});
  CHECK_FALSE(cutter.note({0.0, 0.0, 0.0}, 0));
  CHECK(cutter.note({1.0, 0.0, 0.0}, 0));
  CHECK(cutter.note({1.0, 0.0, 0.0}, 0));
}

TEST_CASE("SubmapCutter: a submap ends after a time, from its first scan on") {
  SubmapCutter cutter({.time_us = 10 * kSecond});
  CHECK_FALSE(cutter.note({0.0, 0.0, 0.0}, 100 * kSecond));
  CHECK_FALSE(cutter.note({0.0, 0.0, 0.0}, 109 * kSecond));
  CHECK(cutter.note({0.0, 0.0, 0.0}, 110 * kSecond) == SubmapEnd::kTime);
  cutter.begin();
  CHECK_FALSE(cutter.note({0.0, 0.0, 0.0}, 119 * kSecond));
  // A stamp from before is none.
  CHECK_FALSE(cutter.note({0.0, 0.0, 0.0}, 0));
  CHECK(cutter.note({0.0, 0.0, 0.0}, 120 * kSecond) == SubmapEnd::kTime);
}

TEST_CASE("SubmapCutter: a jump ends it, and is no way") {
  SubmapCutter cutter({.length_m = 100.0, .jump_m = 3.0});
  CHECK_FALSE(cutter.note({0.0, 0.0, 0.0}, 0));
  CHECK_FALSE(cutter.note({3.0, 0.0, 0.0}, 0));
  CHECK(cutter.note({3.0, 500.0, 0.0}, 0) == SubmapEnd::kJump);
  cutter.begin();
  CHECK_FALSE(cutter.note({3.0, 501.0, 0.0}, 0));
  CHECK(cutter.way_m() == 1.0);
}

TEST_CASE("SubmapCutter: a full one ends early, but not at once; a stretched one late") {
  const SubmapAllowance full{.is_full = true};
  SubmapCutter cutter({.length_m = 8.0, .time_us = 80 * kSecond});
  CHECK_FALSE(cutter.note({0.0, 0.0, 0.0}, 0, full));
  CHECK_FALSE(cutter.note({1.9, 0.0, 0.0}, kSecond, full));
  CHECK(cutter.note({2.1, 0.0, 0.0}, 2 * kSecond, full) == SubmapEnd::kMemory);
  CHECK_FALSE(cutter.note({2.1, 0.0, 0.0}, 3 * kSecond));
  CHECK(cutter.note({2.1, 0.0, 0.0}, 20 * kSecond, full) == SubmapEnd::kMemory);
  cutter.begin();
  const SubmapAllowance twice{.stretch = 2};
  CHECK_FALSE(cutter.note({2.1, 15.9, 0.0}, 21 * kSecond, twice));
  CHECK(cutter.note({2.1, 16.1, 0.0}, 22 * kSecond, twice) == SubmapEnd::kLength);
  cutter.begin();
  CHECK_FALSE(cutter.note({2.1, 16.1, 0.0}, 181 * kSecond, twice));
  CHECK(cutter.note({2.1, 16.1, 0.0}, 182 * kSecond, twice) == SubmapEnd::kTime);
  cutter.begin();
  // However long it may be, one that is full has a quarter of what was asked for.
  const SubmapAllowance both{.stretch = 64, .is_full = true};
  CHECK_FALSE(cutter.note({2.1, 18.0, 0.0}, 183 * kSecond, both));
  CHECK(cutter.note({2.1, 18.2, 0.0}, 184 * kSecond, both) == SubmapEnd::kMemory);
  // What has no limit never ends, full or not.
  SubmapCutter endless({.jump_m = 5.0});
  for (int i = 0; i < 100; ++i) CHECK_FALSE(endless.note({1.0 * i, 0.0, 0.0}, i * kSecond, full));
}

TEST_CASE("SubmapCutter: without limits nothing ends") {
  SubmapCutter cutter;
  for (int i = 0; i < 100; ++i) CHECK_FALSE(cutter.note({1e5 * i, 0.0, 0.0}, i * 1000 * kSecond));
}

}  // namespace
}  // namespace tessera
