// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Every source of recorded scans gives all of them in their order, and says why it ended.
#include <catch2/catch.hpp>
#include <vector>

#include "base/monotonic_clock.hpp"
#include "made_scans.hpp"
#include "scans/open_scans.hpp"
#include "scans/recorded_source.hpp"
#include "scans/replay_source.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::MadeScans;

/// Numbers of the next scans, up to most, until the source has ended.
std::vector<int> numbers(ScanSource& source, std::size_t most, WakeUp& wake) {
  std::vector<int> taken;
  while (taken.size() < most) {
    Scan* const scan = source.front();
    if (scan == nullptr) {
      if (source.ended()) break;
      wake.sleep_until(MonotonicClock::now_us() + 1'000);
      continue;
    }
    CHECK(scan->count == static_cast<std::uint32_t>(scan->number - 9));
    CHECK(scan->points()[0] == static_cast<float>(scan->number - 10));
    taken.push_back(scan->number);
    source.pop();
  }
  return taken;
}

TEST_CASE("scan sources: a recording and its replay give the same scans in each order") {
  const MadeScans scans(3);
  struct Case {
    ScanOrder order;
    std::vector<int> expected;
  };
  const Case cases[] = {{ScanOrder::kOnce, {10, 11, 12}},
                        {ScanOrder::kLoop, {10, 11, 12, 10, 11, 12, 10, 11}},
                        {ScanOrder::kThereAndBack, {10, 11, 12, 12, 11, 10, 10, 11}}};
  for (const Case& c : cases) {
    WakeUp wake;
    RecordedSource recorded(scans, c.order);
    CHECK(numbers(recorded, 8, wake) == c.expected);
    CHECK(recorded.ended() == (c.order == ScanOrder::kOnce));
    ReplaySource replay(scans, {.rate_hz = 0.0, .order = c.order}, wake);
    REQUIRE(replay.start({.name = "read"}, MonotonicClock::now_us()).ok());
    CHECK(numbers(replay, 8, wake) == c.expected);
    replay.stop();
    CHECK(replay.outcome().ok());
  }
}

TEST_CASE("scan sources: a scan stays until it is popped, and is counted once") {
  const MadeScans scans(2);
  RecordedSource source(scans);
  Scan* const first = source.front();
  REQUIRE(first != nullptr);
  CHECK(source.front() == first);
  CHECK(source.counters().offered == 1);
  source.pop();
  source.pop();  // There is none that was read.
  REQUIRE(source.front() != nullptr);
  CHECK(source.front()->number == 11);
  source.pop();
  CHECK(source.front() == nullptr);
  CHECK(source.ended());
  CHECK(source.outcome().ok());
  CHECK(source.counters().offered == 2);
  CHECK(source.counters().unknown_ids == 1);
}

TEST_CASE("scan sources: one that cannot be read ends it, with the reason") {
  MadeScans scans(3);
  scans.unreadable = 1;
  WakeUp wake;
  RecordedSource recorded(scans);
  CHECK(numbers(recorded, 3, wake) == std::vector<int>{10});
  CHECK(recorded.ended());
  REQUIRE_FALSE(recorded.outcome().ok());
  CHECK(recorded.outcome().failure().text() == "unreadable");
  ReplaySource replay(scans, {.rate_hz = 0.0}, wake);
  REQUIRE(replay.start({.name = "read"}, MonotonicClock::now_us()).ok());
  CHECK(numbers(replay, 3, wake) == std::vector<int>{10});
  CHECK(replay.outcome().failure().text() == "unreadable");
}

TEST_CASE("scan sources: a replay takes the time that its rate says") {
  const MadeScans scans(3);
  WakeUp wake;
  ReplaySource replay(scans, {.rate_hz = 50.0, .start_delay_s = 0.02}, wake);
  const std::int64_t start_us = MonotonicClock::now_us();
  REQUIRE(replay.start({.name = "read"}, start_us).ok());
  CHECK(numbers(replay, 3, wake).size() == 3);
  CHECK(MonotonicClock::now_us() - start_us >= 60'000);
}

TEST_CASE("scan sources: what names a source is checked before anything is opened") {
  struct Case {
    SourceOptions options;
    const char* says;  ///< Null: nothing is wrong.
  };
  const std::string folder("folder");
  const std::string file("file");
  const Case cases[] = {
      {{}, "--dataset has no folder"},
      {{.dataset = folder}, nullptr},
      {{.dataset = folder, .poses = file}, "--poses is for"},
      {{.dataset = folder, .intrinsics = file}, "--intrinsics and --label-images are for --depth"},
      {{.pcd = folder}, "--pcd needs a pose"},
      {{.pcd = folder, .poses = file}, nullptr},
      {{.pcd = folder, .poses = file, .deskew = true}, "--deskew is for datasets"},
      {{.pcd = folder, .poses = file, .labels = "predictions"}, "--pcd has labels in the clouds"},
      {{.pcd = folder, .ply = folder, .poses = file}, "mutually exclusive"},
      {{.depth = folder, .poses = file}, "--intrinsics"},
      {{.depth = folder, .intrinsics = file, .poses = file}, nullptr},
  };
  for (const Case& c : cases) {
    const Outcome<void> checked = check_source(c.options);
    CHECK(checked.ok() == (c.says == nullptr));
    if (!checked.ok() && c.says != nullptr) CHECK_THAT(checked.failure().text(), Contains(c.says));
    const bool is_dataset = !c.options.dataset.empty();
    CHECK(dataset_folder(c.options).path == (is_dataset ? folder : std::string()));
  }
}

}  // namespace
}  // namespace tessera
