// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/scan_work.hpp"

#include <catch2/catch.hpp>

#include "hand_clock.hpp"

namespace tessera {

TEST_CASE("ScanWork: without a deadline there is always time, and the budget is the limit") {
  ScanWork work;
  ScanReport report;
  work.begin(nullptr);
  work.set_limit(0, report);
  CHECK_FALSE(work.has_limit());
  CHECK(report.work_limit == 0);
  CHECK(work.in_time(~std::uint64_t{0}));
  work.set_limit(100, report);
  CHECK(work.has_limit());
  CHECK(report.work_limit == 100);
  std::size_t asked = 0;
  CHECK_FALSE(work.is_spent(100, 1000, asked));
  CHECK(work.is_spent(101, 0, asked));
  CHECK_FALSE(work.cut());
}

TEST_CASE("ScanWork: the limit is the budget or what fits the time left, whichever is less") {
  HandClock hand{.time_us = 0};
  Deadline deadline(hand.clock(), 2.0);
  ScanWork work;
  ScanReport report;
  for (const std::uint64_t budget : {0U, 199U, 200U, 201U}) {
    deadline.begin(100);  // 200 units of work
    work.begin(&deadline);
    work.set_limit(budget, report);
    CHECK(work.limit() == (budget == 199 ? 199 : 200));
    CHECK(work.limit_is_deadline() == (budget != 199 && budget != 200));
    const bool by_budget = budget == 199 || budget == 200;
    CHECK(&work.refusals(report, true) ==
          (by_budget ? &report.refused_work : &report.refused_deadline));
    CHECK(&work.refusals(report, false) ==
          (by_budget ? &report.rays_refused_work : &report.rays_refused_deadline));
    deadline.end(0);
  }
}

TEST_CASE("ScanWork: once the time is up it stays up for the scan, and the clock is left alone") {
  HandClock hand{.time_us = 0};
  Deadline deadline(hand.clock(), 1.0);
  ScanWork work;
  ScanReport report;
  deadline.begin(100);
  work.begin(&deadline);
  work.set_limit(0, report);
  CHECK(work.in_time(100));
  CHECK_FALSE(work.in_time(101));  // too much for what is left, and yet not late
  CHECK_FALSE(work.cut());
  hand.time_us = 100;
  CHECK_FALSE(work.in_time());
  CHECK(work.cut());
  const std::uint64_t readings = deadline.readings();
  CHECK_FALSE(work.in_time());
  CHECK(deadline.readings() == readings);
  work.begin(nullptr);
  CHECK(work.in_time());
}

TEST_CASE("ScanWork: while points are admitted the clock is read every kPointBatch of them") {
  HandClock hand{.time_us = 0};
  Deadline deadline(hand.clock(), 1.0);
  ScanWork work;
  ScanReport report;
  deadline.begin(1'000'000);
  work.begin(&deadline);
  work.set_limit(0, report);
  const std::uint64_t before = deadline.readings();
  std::size_t asked = 0;
  for (std::size_t i = 0; i < 3 * ScanWork::kPointBatch; ++i)
    CHECK_FALSE(work.is_spent(0, 0, asked));
  CHECK(deadline.readings() - before == 3);
  hand.time_us = 1'000'000;
  CHECK(work.is_spent(0, 0, asked));
  CHECK(work.limit_is_deadline());
}

TEST_CASE("ScanWork: labels are foreseen by 1.5 times what points took, within the bound") {
  ScanWork work;
  work.begin(nullptr);
  work.set_most_per_point(56);
  CHECK(work.foreseen_per_point() == 56);
  ScanReport report;
  report.evaluations = 800;
  work.learn_from(report, 100);
  CHECK(work.foreseen_per_point() == 13);  // ceil of 12, as a point more is added
  report.evaluations = 100;                // falls by an eighth a scan at most
  work.learn_from(report, 100);
  CHECK(work.foreseen_per_point() == 12);
  report.evaluations = 100'000;
  work.learn_from(report, 100);
  CHECK(work.foreseen_per_point() == 56);
  report.evaluations = 0;
  for (int scan = 0; scan < 100; ++scan) work.learn_from(report, 100);
  const std::uint64_t low = work.foreseen_per_point();
  report.tiles_cut = 1;  // it was too little: twice as much
  work.learn_from(report, 100);
  CHECK(work.foreseen_per_point() == 2 * low);
  work.learn_from(report, 0);
  CHECK(work.foreseen_per_point() == 4 * low);
}

TEST_CASE("ScanWork: what was done is what was foreseen, less the rays that were cut") {
  ScanWork work;
  work.begin(nullptr);
  work.set_most_per_point(10);
  ScanReport report;
  report.evaluations = 50;
  report.ray_steps = 7;
  CHECK(work.done(report, 5, 0) == 0);  // without a limit nothing was predicted
  report.work_predicted = 5 * 10 + 100;
  report.ray_blocks = 2;
  CHECK(work.done(report, 5, 100) == 150 + 2 * ScanWork::kBlockWork);
  report.rays = 3;
  report.rays_cut = 1;
  CHECK(work.done(report, 5, 100) == 150 + 2 * ScanWork::kBlockWork - 25);
  report.tiles_cut = 1;
  CHECK(work.done(report, 5, 100) == 57);
}

TEST_CASE("ScanWork: by the image steps and returns take longer, and blocks half") {
  ScanWork work;
  CHECK(work.to_write(2) == 256);
  work.begin(nullptr, true);
  CHECK(work.to_write(2) == 128);
  work.set_most_per_point(10);
  ScanReport report;
  report.evaluations = 50;
  report.ray_steps = 7;
  report.rays = 3;
  report.work_predicted = 5 * 10 + 7;
  report.ray_blocks = 2;
  CHECK(work.done(report, 5, 0) == 50 + 2 * 7 + 5 * 3 + 128);
  report.ray_blocks_cut = 1;
  report.free_blocks = 1;
  CHECK(work.done(report, 5, 0) == 50 + 2 * 7 + 5 * 3 + 64);
}

}  // namespace tessera
