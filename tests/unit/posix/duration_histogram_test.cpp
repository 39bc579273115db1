// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/duration_histogram.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

TEST_CASE("DurationHistogram: without any durations all is zero") {
  const DurationHistogram histogram;
  CHECK(histogram.count() == 0);
  CHECK(histogram.max_us() == 0);
  CHECK(histogram.quantile_us(0.5) == 0);
}

TEST_CASE("DurationHistogram: a quantile is never less than it is, and at most 3 % more") {
  for (const std::int64_t scale : {1, 7, 1000, 1'000'000}) {
    DurationHistogram histogram;
    for (std::int64_t i = 1; i <= 1000; ++i) histogram.add(scale * i);
    for (const double share : {0.0, 0.25, 0.5, 0.99, 0.999}) {
      const auto exact = scale * (static_cast<std::int64_t>(share * 1000.0) + 1);
      INFO(scale << " " << share);
      CHECK(histogram.quantile_us(share) >= exact);
      CHECK(static_cast<double>(histogram.quantile_us(share)) <=
            1.0313 * static_cast<double>(exact));
    }
    CHECK(histogram.max_us() == 1000 * scale);
    CHECK(histogram.quantile_us(1.0) == 1000 * scale);
  }
}

TEST_CASE("DurationHistogram: what is out of its range counts as its end") {
  DurationHistogram histogram;
  histogram.add(-5);
  CHECK(histogram.quantile_us(0.5) == 0);
  histogram.add(INT64_MAX);
  CHECK(histogram.max_us() == std::int64_t{1} << 40);
  CHECK(histogram.quantile_us(0.9) == std::int64_t{1} << 40);
  histogram.clear();
  CHECK(histogram.count() == 0);
}

TEST_CASE("DurationHistogram: its buckets are visited shortest first, and hold all") {
  DurationHistogram histogram;
  for (const std::int64_t us : {7, 7, 500, 1'000'000}) histogram.add(us);
  std::uint64_t count = 0;
  std::int64_t last_us = -1;
  histogram.for_each([&](std::int64_t most_us, std::uint64_t some) {
    CHECK(most_us > last_us);
    last_us = most_us;
    count += some;
  });
  CHECK(count == 4);
  CHECK(last_us >= 1'000'000);
  CHECK(last_us <= 1'030'000);
}

}  // namespace
}  // namespace tessera
