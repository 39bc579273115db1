// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is published again, and when.
#include <catch2/catch.hpp>
#include <numeric>

#include "sample_robot.hpp"

namespace tessera {

namespace {

/// A change of meaning in each of these blocks: the voxel's label is the next one.
void relabel(LocalMap& map, int first, int end, int round) {
  for (int i = first; i < end; ++i) {
    const float weight = static_cast<float>(1 << std::min(round, 5));
    REQUIRE(hit(map, voxel_of_block(i), 1 + round % 3, weight) == Status::kOk);
  }
}

}  // namespace

TEST_CASE("Publisher: a voxel that changes while nothing else does is published at the next tick") {
  SampleRobot robot;
  robot.tick();
  REQUIRE(hit(robot.map(), {-1, -9, 3}, 2, 1.0F) == Status::kOk);
  const PublisherReport report = robot.tick();
  CHECK(report.published == 1);
  CHECK(report.bytes.labels == 13);
  CHECK(report.worst_staleness_us == kTick_us);
  CHECK(robot.disagreement() == 0);

  REQUIRE(carve(robot.map(), {100, 0, 0}) == Status::kOk);
  CHECK(robot.tick().published == 1);
  CHECK(robot.disagreement() == 0);
}

TEST_CASE("Publisher: it does the same wherever its clock begins, below zero too") {
  const auto published_from = [](std::int64_t begin_us) {
    SampleRobot robot;
    robot.budget.label_bytes = 100;
    robot.now_us = begin_us;
    std::vector<std::uint64_t> published;
    for (int round = 0; round < 40; ++round) {
      relabel(robot.map(), 0, 30, round / 10);
      published.push_back(robot.tick().published);
    }
    return published;
  };
  const std::vector<std::uint64_t> wanted = published_from(0);
  CHECK(std::accumulate(wanted.begin(), wanted.end(), std::uint64_t{0}) > 30);
  for (const std::int64_t begin_us :
       {-3'600'000'000, std::int64_t{-1}, std::int64_t{1}, 3'600'000'000})
    CHECK(published_from(begin_us) == wanted);
}

TEST_CASE("Publisher: nothing changed, nothing is compared or sent") {
  SampleRobot robot;
  relabel(robot.map(), 0, 20, 0);
  CHECK(robot.tick().published == 20);
  for (int i = 0; i < 100; ++i) {
    const PublisherReport report = robot.tick();
    CHECK(report.noted == 0);
    CHECK(report.compared == 0);
    CHECK(report.published == 0);
  }
}

TEST_CASE("Publisher: more of the same evidence is sent only when it is several times as much") {
  SampleRobot robot;
  REQUIRE(hit(robot.map(), {0, 0, 0}, 1, 1.0F) == Status::kOk);
  CHECK(robot.tick().published == 1);
  for (int i = 0; i < 3; ++i) {
    REQUIRE(hit(robot.map(), {0, 0, 0}, 1, 1.0F) == Status::kOk);
    const PublisherReport report = robot.tick();
    CHECK(report.compared == 1);
    CHECK(report.unchanged == 1);
    CHECK(report.published == 0);
  }
  REQUIRE(hit(robot.map(), {0, 0, 0}, 1, 1.0F) == Status::kOk);  // now more than four
  CHECK(robot.tick().published == 1);
}

TEST_CASE("Publisher: what the wire cannot say is no reason to publish") {
  SampleRobot robot;
  robot.kept.quantise = round_counts;
  REQUIRE(hit(robot.map(), {0, 0, 0}, 1, 16.0F) == Status::kOk);
  REQUIRE(hit(robot.map(), {0, 0, 0}, 2, 16.0F) == Status::kOk);
  CHECK(robot.tick().published == 1);
  REQUIRE(hit(robot.map(), {0, 0, 0}, 2, 0.5F) == Status::kOk);  // another label, by less than said
  const PublisherReport report = robot.tick();
  CHECK(report.compared == 1);
  CHECK(report.unchanged == 1);
  CHECK(report.published == 0);
}

TEST_CASE("Publisher: under load blocks are held off, and never out later than the bound") {
  SampleRobot robot;
  constexpr int kBlocks = 1500;
  robot.budget.label_bytes = 12000;
  std::uint64_t published = 0;
  for (int i = 0; i < 100; ++i) {
    for (int b = 0; i % 2 == 0 && b < kBlocks; ++b) {
      const VoxelCoord next{8 * b + i / 2 % 8, i / 16, 0};
      REQUIRE(hit(robot.map(), next, 1, 1.0F) == Status::kOk);
    }
    const PublisherReport report = robot.tick();
    CHECK(report.worst_staleness_us <= 1'000'000);
    CHECK(report.overdue == 0);
    published += report.published;
  }
  // Each changed 50 times within five seconds.
  CHECK(published >= 4 * kBlocks);
  CHECK(published <= 8 * kBlocks);
  CHECK(robot.publisher.totals().worst_staleness_us <= 1'000'000);
}

TEST_CASE("Publisher: what the budget does not allow is counted, and goes out oldest first") {
  SampleRobot robot;
  robot.tick();
  robot.budget.label_bytes = 130;  // ten blocks
  relabel(robot.map(), 0, 500, 0);
  robot.tick();
  relabel(robot.map(), 500, 600, 0);
  std::uint32_t late = 0;
  int ticks = 0;
  while (robot.kept.log.size() < 600) {
    const PublisherReport report = robot.tick();
    CHECK(report.bytes.labels < 130 + 13);
    late = std::max(late, report.overdue);
    REQUIRE(++ticks < 100);
  }
  CHECK(late > 200);
  CHECK(robot.publisher.totals().worst_staleness_us > 2'000'000);
  CHECK(robot.publisher.totals().by_staleness[15] > 0);
  for (std::size_t i = 0; i < 500; ++i) CHECK(robot.kept.log[i] < key_of_block(500));
  CHECK(robot.disagreement() == 0);
}

TEST_CASE("Publisher: what is new near the focus comes before what is far, and old before both") {
  PublisherConfig config;
  config.many_voxels = 1;
  SampleRobot robot(config);
  robot.tick();
  robot.publisher.set_focus({1000, 0, 0});
  robot.budget.label_bytes = 1000;
  robot.budget.compared = 4;  // of each tick
  relabel(robot.map(), 0, 40, 0);
  relabel(robot.map(), 1000, 1008, 0);
  while (robot.kept.log.size() < 48) robot.tick();
  for (std::size_t i = 0; i < 8; ++i) CHECK(robot.kept.log[i] >= key_of_block(1000));
  CHECK(robot.kept.log.back() < key_of_block(40));
}

TEST_CASE(
    "Publisher: many voxels that differ do not wait while there is budget to spare, one does") {
  SampleRobot robot;
  relabel(robot.map(), 0, 400, 0);
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y)
      REQUIRE(hit(robot.map(), {8 * 400 + x, y, 0}, 1, 1.0F) == Status::kOk);
  }
  REQUIRE(robot.settles(100));
  robot.kept.log.clear();
  robot.budget.label_bytes = 2000;
  relabel(robot.map(), 0, 400, 1);
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; y < 8; ++y)
      REQUIRE(hit(robot.map(), {8 * 400 + x, y, 1}, 1, 1.0F) == Status::kOk);
  }
  std::size_t place = 0;
  REQUIRE(robot.settles(100));
  while (robot.kept.log[place] != key_of_block(400)) ++place;
  CHECK(place < 200);
  CHECK(robot.publisher.totals().worst_staleness_us <= 1'000'000);
}

TEST_CASE("Publisher: voxels that are only free wait longer where much waits") {
  SampleRobot robot;
  robot.tick();
  robot.budget.label_bytes = 4000;
  for (int i = 0; i < 500; ++i) REQUIRE(carve(robot.map(), {8 * i, 80, 0}) == Status::kOk);
  relabel(robot.map(), 0, 500, 0);
  robot.tick();
  std::size_t after_a_second = 0;
  for (int i = 1; i < 80; ++i) {
    robot.tick();
    if (i == 20) after_a_second = robot.kept.log.size();
  }
  CHECK(after_a_second >= 500);
  CHECK(after_a_second < 900);
  CHECK(robot.kept.log.size() == 1000);
  CHECK(robot.disagreement() == 0);
}

TEST_CASE("Publisher: few voxels wait like free ones where they are set to") {
  PublisherConfig config;
  config.few_voxels = 2;
  SampleRobot robot(config);
  robot.budget.label_bytes = 2000;
  relabel(robot.map(), 0, 500, 0);
  robot.tick();
  for (int i = 0; i < 21; ++i) robot.tick();
  CHECK(robot.kept.log.size() < 400);
  REQUIRE(robot.settles(100));
  CHECK(robot.disagreement() == 0);
}

TEST_CASE("Publisher: what finds no place among those that wait is found again") {
  PublisherConfig config;
  config.candidates = 64;
  SampleRobot robot(config);
  relabel(robot.map(), 0, 1000, 0);
  robot.budget.compared = 40;
  CHECK(robot.tick().left_out > 0);
  REQUIRE(robot.settles(500));
  CHECK(robot.publisher.totals().left_out > 0);
  CHECK(robot.disagreement() == 0);
}

TEST_CASE("Publisher: blocks beyond its number are left out and counted") {
  PublisherConfig config;
  config.blocks = 64;
  config.candidates = 64;
  for (const int count : {63, 64, 65}) {
    SampleRobot robot(config);
    relabel(robot.map(), 0, count, 0);
    for (int i = 0; i < 30; ++i) robot.tick();
    CHECK(robot.kept.blocks.size() == static_cast<std::size_t>(std::min(count, 64)));
    CHECK((robot.publisher.totals().left_out > 0) == (count > 64));
    for (int i = 0; i < 64; ++i) {  // others are watched all the same
      REQUIRE(hit(robot.map(), voxel_of_block(i), 2, 9.0F) == Status::kOk);
    }
    for (int i = 0; i < 30; ++i) robot.tick();
    CHECK(robot.kept.log.size() >= static_cast<std::size_t>(63 + std::min(count, 64)));
    for (int i = 0; i < 2; ++i) {  // those that leave make room
      robot.map().remove_block(robot.map().find_handle(block_of(voxel_of_block(i))));
    }
    for (int i = 0; i < 30; ++i) robot.tick();
    CHECK(robot.disagreement() == 0);
  }
}

TEST_CASE("Publisher: a sweep of a page a tick misses no block while others are opened") {
  SampleRobot robot({}, 4096);
  robot.budget.entries = 512;
  for (int i = 0; i < 200; ++i) {
    relabel(robot.map(), 20 * i, 20 * i + 20, 0);
    CHECK(robot.tick().entries <= 512);
  }
  for (int i = 0; i < 200; ++i) robot.tick();
  CHECK(robot.kept.blocks.size() == 4000);
  CHECK(robot.disagreement() == 0);
}

TEST_CASE("Publisher: a refused block is tried again") {
  SampleRobot robot;
  robot.kept.refuses = true;
  relabel(robot.map(), 0, 20, 0);
  PublisherReport report = robot.tick();
  CHECK(report.refused == 8);  // then there is most likely no room for anything
  CHECK(report.published == 0);
  CHECK(report.waiting == 20);
  for (int i = 0; i < 10; ++i) robot.tick();
  robot.kept.refuses = false;
  REQUIRE(robot.settles(10));
  CHECK(robot.kept.log.size() == 20);
  CHECK(robot.disagreement() == 0);
  CHECK(robot.publisher.totals().refused >= 8);
}

TEST_CASE("Publisher: time that goes back stands still") {
  SampleRobot robot;
  robot.tick(1'000'000);
  relabel(robot.map(), 0, 1, 0);
  CHECK(robot.tick(-500'000).published == 1);
  CHECK(robot.publisher.totals().worst_staleness_us == 0);
}

TEST_CASE("Publisher: no budget, nothing done, an unmade one does nothing") {
  SampleRobot robot;
  relabel(robot.map(), 0, 3, 0);
  robot.budget = {.entries = 0, .compared = 0, .label_bytes = 0, .free_bytes = 0};
  const PublisherReport report = robot.tick();
  CHECK(report.compared == 0);
  CHECK(report.published == 0);
  CHECK(report.waiting == 3);
  Publisher none;
  CHECK(none.tick(robot.map(), 0, kPlenty, robot.kept.interface()).published == 0);
}

}  // namespace tessera
