// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A number of a report is written once, as a row; everything else comes from the row.
#include "tessera/base/counters.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <string>

#include "tessera/exchange/exchange_config.hpp"
#include "tessera/exchange/publication.hpp"
#include "tessera/fusion/global_map_config.hpp"
#include "tessera/inference/scan_report.hpp"
#include "tessera/map/moving_window.hpp"

namespace tessera {

#define SAMPLE_COUNTERS(ROW)                                 \
  ROW(COUNTER, uint32_t, apples, "Apples that were picked.") \
  ROW(LEVEL, int64_t, ripest_us, "Age of the ripest.")       \
  ROW(RESERVED, uint32_t, reserved, "")                      \
  ROW(TOTAL, uint32_t, fruit, "Fruit of all kinds.")

struct CountedSample {
  SAMPLE_COUNTERS(TESSERA_COUNTER_MEMBER)
  std::uint32_t pears = 0;
  [[nodiscard]] std::uint32_t fruit() const { return apples + pears; }
};
TESSERA_COUNTER_TABLE(CountedSample, SAMPLE_COUNTERS(TESSERA_COUNTER_ROW))
TESSERA_COUNTER_SUMS(CountedSamples, CountedSample, SAMPLE_COUNTERS)

namespace {

template <class Report>
std::set<std::string> names() {
  std::set<std::string> found;
  for (const Counter<Report>& row : kCounters<Report>) {
    CHECK(std::string(row.sentence).ends_with("."));
    CHECK(found.insert(row.name).second);
  }
  return found;
}

TEST_CASE("counters: a table has a row for each number but the reserved ones") {
  CountedSample report;
  report.apples = 3;
  report.ripest_us = 7;
  report.pears = 4;
  REQUIRE(kCounters<CountedSample>.size() == 3);
  CHECK(std::string(kCounters<CountedSample>[0].name) == "apples");
  CHECK(std::string(kCounters<CountedSample>[0].sentence) == "Apples that were picked.");
  CHECK(kCounters<CountedSample>[0].value(report) == 3);
  CHECK(kCounters<CountedSample>[1].value(report) == 7);
  CHECK(kCounters<CountedSample>[2].value(report) == 7);
}

TEST_CASE("counters: over reports counts add up in 64 bits, and of a level the highest stays") {
  CountedSample report;
  report.apples = 0xffffffffU;
  report.ripest_us = 7;
  CountedSamples totals;
  totals.add(report);
  report.ripest_us = 5;
  totals.add(report);
  CHECK(totals.apples == 0x1fffffffeULL);
  CHECK(totals.ripest_us == 7);
  CHECK(totals.fruit == 0x1fffffffeULL);
  CHECK(kCounters<CountedSamples>[0].value(totals) == 0x1fffffffeLL);
}

TEST_CASE("counters: no report of the library has a name twice, and each has its sentence") {
  CHECK(names<ScanReport>() == names<ScanTotals>());
  CHECK(names<PublisherReport>() == names<TickSums>());
  CHECK(names<ExchangeReport>().count("refused_tag") == 1);
  CHECK(names<WindowReport>().count("lost_blocks") == 1);
  CHECK(names<GlobalMapReport>().count("torn_blocks") == 1);
}

}  // namespace
}  // namespace tessera
