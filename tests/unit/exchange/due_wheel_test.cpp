// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/due_wheel.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <vector>

namespace tessera {

namespace {

struct Records {
  std::array<DueLink, 32> links{};
  DueLink& link(std::uint32_t number) { return links[number - 1]; }
};

std::vector<std::uint32_t> drained(DueWheel& wheel, Records& records) {
  std::vector<std::uint32_t> order;
  while (const std::uint32_t number = wheel.first()) {
    order.push_back(number);
    wheel.remove(records, number);
  }
  return order;
}

}  // namespace

TEST_CASE("DueWheel: records come by the interval in which they are due, then as they came") {
  Records records;
  DueWheel wheel(100);
  wheel.insert(records, 1, 550);
  wheel.insert(records, 2, 120);
  wheel.insert(records, 3, 199);
  wheel.insert(records, 4, 100);
  wheel.insert(records, 5, 0);
  CHECK(wheel.waiting() == 5);
  wheel.remove(records, 3);
  wheel.remove(records, 3);
  CHECK(drained(wheel, records) == std::vector<std::uint32_t>{5, 2, 4, 1});
  CHECK(wheel.waiting() == 0);
}

TEST_CASE(
    "DueWheel: what is due beyond the last interval is in it, what was due before in the first") {
  Records records;
  DueWheel wheel(10);
  wheel.advance(1'000'000);
  wheel.insert(records, 1, 1'000'000 + 630);
  wheel.insert(records, 2, 1'000'000 + 640);
  wheel.insert(records, 3, 1'000'000 + 639);
  wheel.insert(records, 4, 5);
  CHECK(wheel.overdue(1'000'000) == 0);
  CHECK(wheel.overdue(1'000'001) == 1);
  wheel.advance(1'000'100);  // never past what waits
  CHECK(wheel.overdue(1'000'001) == 1);
  CHECK(drained(wheel, records) == std::vector<std::uint32_t>{4, 1, 2, 3});
}

TEST_CASE("DueWheel: the pace is what makes nothing late, and even") {
  Records records;
  DueWheel wheel(100);
  CHECK(wheel.pace(0, 100) == 0);
  for (std::uint32_t i = 1; i <= 10; ++i) wheel.insert(records, i, 1000);
  CHECK(wheel.pace(0, 100) == 1);    // eleven ticks
  CHECK(wheel.pace(600, 100) == 2);  // five
  CHECK(wheel.pace(1000, 100) == 10);
  CHECK(wheel.pace(5000, 100) == 10);
  for (std::uint32_t i = 11; i <= 16; ++i) wheel.insert(records, i, 200);
  CHECK(wheel.pace(0, 100) == 2);  // six in three ticks, then the ten
  CHECK(wheel.pace(100, 100) == 3);
  CHECK(wheel.pace(100, 1) == 1);
}

}  // namespace tessera
