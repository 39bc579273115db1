// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A number of a report is written once, as a row; everything else comes from the row.
#include "tessera/base/counters.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "tessera/exchange/exchange_config.hpp"
#include "tessera/exchange/publication.hpp"
#include "tessera/fusion/global_map_config.hpp"
#include "tessera/inference/scan_report.hpp"
#include "tessera/map/moving_window.hpp"
#include "tessera/registration/depth_image.hpp"
#include "tessera/registration/deskew.hpp"
#include "tessera/registration/label_projection.hpp"

namespace tessera {

#define SAMPLE_COUNTERS(ROW)                                 \
  ROW(COUNTER, uint32_t, apples, "Apples that were picked.") \
  ROW(LEVEL, int64_t, ripest_us, "Age of the ripest.")       \
  ROW(FIGURE, double, mean_kg, "Mean weight.")               \
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
  report.mean_kg = 0.25;
  REQUIRE(kCounters<CountedSample>.size() == 4);
  CHECK(std::string(kCounters<CountedSample>[0].name) == "apples");
  CHECK(std::string(kCounters<CountedSample>[0].sentence) == "Apples that were picked.");
  CHECK(kCounters<CountedSample>[0].value(report) == 3);
  CHECK(kCounters<CountedSample>[1].value(report) == 7);
  CHECK(kCounters<CountedSample>[3].value(report) == 7);
}

TEST_CASE("counters: a figure is a number that is not whole, all others are whole") {
  CountedSample report;
  report.apples = 3;
  report.mean_kg = 0.25;
  std::vector<double> figures;
  std::vector<std::int64_t> whole;
  for (const Counter<CountedSample>& row : kCounters<CountedSample>) {
    with_number(row, report, [&](auto number) {
      if constexpr (std::is_same_v<decltype(number), double>)
        figures.push_back(number);
      else
        whole.push_back(number);
    });
  }
  CHECK(figures == std::vector<double>{0.25});
  CHECK(whole == std::vector<std::int64_t>{3, 0, 3});
}

TEST_CASE("counters: over reports counts add up in 64 bits, and of a level the highest stays") {
  CountedSample report;
  report.apples = 0xffffffffU;
  report.ripest_us = 7;
  report.mean_kg = 0.25;
  CountedSamples totals;
  totals.add(report);
  report.ripest_us = 5;
  report.mean_kg = 0.125;
  totals.add(report);
  CHECK(totals.apples == 0x1fffffffeULL);
  CHECK(totals.ripest_us == 7);
  CHECK(totals.mean_kg == 0.25);
  CHECK(totals.fruit == 0x1fffffffeULL);
  CHECK(kCounters<CountedSamples>[0].value(totals) == 0x1fffffffeLL);
}

TEST_CASE("counters: no report of the library has a name twice, and each has its sentence") {
  CHECK(names<ScanReport>() == names<ScanTotals>());
  CHECK(names<PublisherReport>() == names<TickSums>());
  CHECK(names<ExchangeReport>().count("refused_tag") == 1);
  CHECK(names<WindowReport>().count("lost_blocks") == 1);
  CHECK(names<GlobalMapReport>().count("torn_blocks") == 1);
  CHECK(names<ReplicasUsage>().count("replicas_stale") == 1);
  CHECK(names<DeskewReport>().count("bad_time") == 1);
  CHECK(names<DepthReport>().count("no_ray") == 1);
  CHECK(names<LabelReport>().count("cells_read") == 1);
  CHECK(names<LabelCameraReport>().count("better_other") == 1);
}

TEST_CASE("counters: the global map and its replicas stand in one object, so no name is in both") {
  std::set<std::string> all = names<GlobalMapReport>();
  for (const std::string& name : names<ReplicasUsage>()) CHECK(all.insert(name).second);
}

}  // namespace
}  // namespace tessera
