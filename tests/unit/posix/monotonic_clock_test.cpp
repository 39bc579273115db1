// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/monotonic_clock.hpp"

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

}  // namespace
}  // namespace tessera
