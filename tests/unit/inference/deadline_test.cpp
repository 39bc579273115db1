// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/deadline.hpp"

#include <catch2/catch.hpp>

#include "hand_clock.hpp"

namespace tessera {
namespace {

/// One scan of so much work in so much time.
void measure(Deadline& deadline, HandClock& hand, std::uint64_t work, std::int64_t time_us) {
  deadline.begin(hand.time_us + 1'000'000);
  static_cast<void>(deadline.begin_work());
  hand.time_us += time_us;
  deadline.end(work);
}

}  // namespace

TEST_CASE("Deadline: without a clock everything is allowed and nothing is late") {
  Deadline deadline;
  deadline.begin(-5);
  CHECK(deadline.begin_work() >= 1'000'000'000'000U);
  CHECK(deadline.allows(1'000'000'000'000U));
  deadline.end(100);
  CHECK(deadline.overshoot_us() == 0);
  CHECK(deadline.readings() == 0);
}

TEST_CASE("Deadline: before a scan was measured the first rate holds") {
  HandClock hand{.time_us = 400};
  Deadline deadline(hand.clock(), 2.0);
  deadline.begin(500);
  CHECK(deadline.begin_work() == 200);
  CHECK(deadline.allows(200));
  CHECK_FALSE(deadline.allows(201));
  CHECK(Deadline(hand.clock(), 0.0).rate() == Deadline::kFirstRate);
  CHECK(Deadline(hand.clock(), -1.0).rate() == Deadline::kFirstRate);
}

TEST_CASE("Deadline: at its time and after it nothing is allowed, not even no work") {
  HandClock hand{.time_us = 499};
  Deadline deadline(hand.clock(), 2.0);
  deadline.begin(500);
  CHECK(deadline.allows(0));
  hand.time_us = 500;
  CHECK_FALSE(deadline.allows(0));
  CHECK(deadline.begin_work() == 0);
  hand.time_us = 530;
  CHECK_FALSE(deadline.allows(0));
  CHECK(deadline.begin_work() == 0);
}

TEST_CASE("Deadline: lateness is that of the last scan") {
  HandClock hand;
  Deadline deadline(hand.clock());
  deadline.begin(100);
  hand.time_us = 130;
  deadline.end(0);
  CHECK(deadline.overshoot_us() == 30);
  deadline.begin(140);
  CHECK(deadline.overshoot_us() == 0);
  deadline.end(0);
  CHECK(deadline.overshoot_us() == 0);
  hand.time_us = 140;
  deadline.end(0);
  CHECK(deadline.overshoot_us() == 0);
}

TEST_CASE("Deadline: the rate is three quarters of the window's work by its time") {
  HandClock hand;
  Deadline deadline(hand.clock());
  measure(deadline, hand, 1000, 10);
  CHECK(deadline.rate() == Approx(75.0));
  measure(deadline, hand, 200, 30);
  CHECK(deadline.rate() == Approx(0.75 * 1200 / 40));
  SECTION("a small scan that is fixed cost for the most part weighs little") {
    measure(deadline, hand, 1, 1);
    CHECK(deadline.rate() == Approx(0.75 * 1201 / 41));
  }
  SECTION("scans without work are not measured") {
    measure(deadline, hand, 0, 5000);
    CHECK(deadline.rate() == Approx(0.75 * 1200 / 40));
  }
  SECTION("the ninth scan replaces the first") {
    for (std::size_t i = 2; i < Deadline::kWindow; ++i) measure(deadline, hand, 100, 10);
    CHECK(deadline.rate() == Approx(0.75 * 1800 / 100));
    measure(deadline, hand, 100, 10);
    CHECK(deadline.rate() == Approx(0.75 * 900 / 100));
  }
}

TEST_CASE("Deadline: a scan quicker than the clock's tick counts as one tick") {
  HandClock hand;
  Deadline deadline(hand.clock());
  measure(deadline, hand, 600, 0);
  CHECK(deadline.rate() == Approx(450.0));
}

TEST_CASE("Deadline: time from begin_work on is measured, what came before it is not") {
  HandClock hand;
  Deadline deadline(hand.clock());
  deadline.begin(10'000);
  hand.time_us = 5'000;
  static_cast<void>(deadline.begin_work());
  hand.time_us = 5'100;
  deadline.end(1000);
  CHECK(deadline.rate() == Approx(7.5));
  SECTION("and a scan that never got there is not measured") {
    deadline.begin(20'000);
    hand.time_us = 30'000;
    deadline.end(50);
    CHECK(deadline.rate() == Approx(7.5));
    CHECK(deadline.overshoot_us() == 10'000);
  }
}

TEST_CASE("Deadline: every decision is one reading") {
  HandClock hand;
  Deadline deadline(hand.clock());
  deadline.begin(100);
  CHECK(deadline.readings() == 0);
  static_cast<void>(deadline.begin_work());
  static_cast<void>(deadline.allows(1));
  deadline.end(1);
  CHECK(deadline.readings() == 3);
}

}  // namespace tessera
