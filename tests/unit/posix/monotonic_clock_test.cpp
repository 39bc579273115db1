// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "posix/monotonic_clock.hpp"

#include <catch2/catch.hpp>
#include <cstdint>

namespace tessera {
namespace {

TEST_CASE("MonotonicClock: never runs backwards and does move") {
  const std::int64_t start_us = MonotonicClock::now_us();
  std::int64_t last_us = start_us;
  bool backwards = false;
  while (last_us < start_us + 2000) {
    const std::int64_t now_us = MonotonicClock::now_us();
    backwards = backwards || now_us < last_us;
    last_us = now_us;
  }
  CHECK_FALSE(backwards);
}

TEST_CASE("MonotonicClock: seconds and microseconds are the same time") {
  const std::int64_t before_us = MonotonicClock::now_us();
  const double now_s = MonotonicClock::now_s();
  const std::int64_t after_us = MonotonicClock::now_us();
  CHECK(now_s * 1e6 >= static_cast<double>(before_us) - 1.0);
  CHECK(now_s * 1e6 <= static_cast<double>(after_us) + 2.0);
}

}  // namespace
}  // namespace tessera
