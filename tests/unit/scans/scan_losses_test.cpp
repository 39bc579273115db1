// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/scan_losses.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

ScanTotals totals_of(const ScanReport& report) {
  ScanTotals totals;
  totals.add(report);
  return totals;
}

TEST_CASE("scan losses: memory and work leave out points and rays, and memory whole returns") {
  ScanReport report;
  report.over_capacity = 1;
  report.refused_storage = 10;
  report.refused_tiles = 100;
  report.refused_ray_blocks = 1000;
  report.rays_refused_memory = 10'000;
  report.refused_work = 2;
  report.rays_refused_work = 20;
  report.refused_deadline = 3;
  const ScanTotals totals = totals_of(report);
  CHECK(left_out_for_memory(totals) == 11'111);
  CHECK(left_out_for_work(totals) == 22);
}

TEST_CASE("scan losses: each reason why nothing was mapped has its sentence") {
  const auto says = [](const ScanReport& report, Speaker speaker) {
    const ScanTotals totals = totals_of(report);
    const auto why = why_nothing_mapped(totals);
    return why ? text_of(*why, totals).text(speaker) : "";
  };
  ScanReport report;
  CHECK(says(report, Speaker::kCommand) ==
        "nothing was mapped: the scans have no points; check the input");
  CHECK(says(report, Speaker::kPython) ==
        "nothing was mapped: the scan has no points; check the input");
  report.points = report.beyond_range = 3;
  CHECK(says(report, Speaker::kCommand) ==
        "no point was mapped: all 3 points are beyond --max-range; give a larger one, or points in "
        "metres");
  CHECK(says(report, Speaker::kPython) ==
        "no point was mapped: all 3 points are beyond max_range_m; give a larger one, or points in "
        "metres");
  report.points = 5;
  report.in_range = 1;
  CHECK(says(report, Speaker::kCommand) ==
        "no point was mapped: of 5 points 3 are beyond --max-range and 1 within it; the report "
        "says why each was left out");
  report.admitted = 1;
  CHECK(says(report, Speaker::kCommand).empty());
}

TEST_CASE("scan losses: unknown ids are listed, and cut where there may be more") {
  UnknownRawIds ids;
  ids.add(7);
  ids.add(300);
  ids.add(7);
  CHECK(text_of(ids) == "3 points with class ids that are in no class (7, 300)");
  CHECK(text_of(ids, "labels") ==
        "3 points of labels with class ids that are in no class (7, 300)");
  for (std::uint16_t id = 1; id <= 6; ++id) ids.add(id);
  CHECK(text_of(ids) ==
        "9 points with class ids that are in no class (7, 300, 1, 2, 3, 4, 5, 6, ...)");
}

}  // namespace
}  // namespace tessera
