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

TEST_CASE("SubmapCutter: without limits nothing ends") {
  SubmapCutter cutter;
  for (int i = 0; i < 100; ++i) CHECK_FALSE(cutter.note({1e5 * i, 0.0, 0.0}, i * 1000 * kSecond));
}

}  // namespace
}  // namespace tessera
