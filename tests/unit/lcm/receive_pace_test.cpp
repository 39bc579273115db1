// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/receive_pace.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

struct Totals {
  std::int64_t worked_us = 0;
  std::int64_t passed_us = 0;
  std::int64_t batches = 0;
};

/// A second of datagrams that come evenly at this rate, each taking cost_us, at most 256 a batch.
/// Those that wait while the thread works or pauses are in the next batch.
Totals second_of(std::int64_t per_s, double cost_us) {
  ReceivePace pace;
  Totals totals;
  std::int64_t now_us = 1'000'000;
  const std::int64_t start_us = now_us;
  std::int64_t taken = 0;
  while (now_us - start_us < 1'000'000) {
    const std::int64_t arrived = (now_us - start_us) * per_s / 1'000'000;
    const std::int64_t batch = std::min<std::int64_t>(arrived - taken, 256);
    if (batch == 0) {
      now_us += 1'000'000 / per_s;
      continue;
    }
    taken += batch;
    const auto worked_us = static_cast<std::int64_t>(cost_us * static_cast<double>(batch));
    now_us += worked_us;
    now_us += pace.pause_us(batch, worked_us, now_us);
    totals.worked_us += worked_us;
    ++totals.batches;
  }
  totals.passed_us = now_us - start_us;
  return totals;
}

TEST_CASE("ReceivePace: up to its rate nothing pauses") {
  ReceivePace pace;
  for (std::int64_t i = 1; i <= 100'000; ++i)
    REQUIRE(pace.pause_us(1, 5, i * 1'000'000 / ReceivePace::kFree_per_s) == 0);
}

TEST_CASE("ReceivePace: a burst within its bound does not pause, the next datagram does") {
  ReceivePace pace;
  CHECK(pace.pause_us(ReceivePace::kBurst, 2'000, 5'000'000) == 0);
  CHECK(pace.pause_us(1, 5, 5'000'000) == ReceivePace::kLeast_us);
}

TEST_CASE("ReceivePace: whatever comes, however long each takes, at most half of a core is used") {
  for (const std::int64_t per_s : {10'000, 50'000, 200'000, 1'000'000}) {
    for (const double cost_us : {0.5, 2.0, 8.0, 50.0}) {
      CAPTURE(per_s, cost_us);
      const Totals totals = second_of(per_s, cost_us);
      // Half, and what comes before the first pause.
      const auto burst_us = static_cast<std::int64_t>(cost_us * (ReceivePace::kBurst + 256));
      CHECK(2 * totals.worked_us <= totals.passed_us + 2 * burst_us);
    }
  }
}

TEST_CASE("ReceivePace: a flood is taken in batches, not one by one") {
  CHECK(second_of(50'000, 2.0).batches < 2'000);
}

TEST_CASE("ReceivePace: after a flood nothing pauses any more") {
  ReceivePace pace;
  for (std::int64_t i = 0; i < 1'000; ++i)
    static_cast<void>(pace.pause_us(256, 500, 1'000'000 + i * 1'500));
  const std::int64_t end_us = 1'000'000 + 1'500'000;
  CHECK(pace.pause_us(1, 5, end_us + 300'000) == 0);
}

}  // namespace
}  // namespace tessera
