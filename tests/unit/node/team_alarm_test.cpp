// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the bus is told of numbers and contents that are used twice, and for how long.
#include "node/team_alarm.hpp"

#include <catch2/catch.hpp>

namespace tessera {
namespace {

constexpr std::int64_t kStart_us = 1'000'000;

TEST_CASE("TeamAlarm: nothing that was counted is nothing that is told") {
  TeamAlarm alarm;
  CHECK(alarm.look({}, kStart_us) == PauseReason::kNone);
  CHECK(alarm.look({}, 2 * kStart_us) == PauseReason::kNone);
}

TEST_CASE("TeamAlarm: each counter has its reason, until 10 s after it grew last") {
  const auto check = [](const TeamCounters& once, const TeamCounters& twice, PauseReason reason) {
    TeamAlarm alarm;
    CHECK(alarm.look(once, kStart_us) == reason);
    CHECK(alarm.look(once, kStart_us + TeamAlarm::kTold_us - 1) == reason);
    CHECK(alarm.look(once, kStart_us + TeamAlarm::kTold_us) == PauseReason::kNone);
    const std::int64_t again_us = kStart_us + 2 * TeamAlarm::kTold_us;
    CHECK(alarm.look(twice, again_us) == reason);
    CHECK(alarm.look(twice, again_us + TeamAlarm::kTold_us) == PauseReason::kNone);
  };
  check({.own_twins = 1}, {.own_twins = 2}, PauseReason::kTwin);
  check({.other_twins = 1}, {.other_twins = 2}, PauseReason::kOtherTwin);
  check({.conflicts = 1}, {.conflicts = 2}, PauseReason::kConflict);
}

TEST_CASE(
    "TeamAlarm: a twin of this robot comes before one of others, and that before a conflict") {
  TeamAlarm alarm;
  CHECK(alarm.look({.conflicts = 1}, kStart_us) == PauseReason::kConflict);
  CHECK(alarm.look({.other_twins = 1, .conflicts = 1}, kStart_us + 1) == PauseReason::kOtherTwin);
  CHECK(alarm.look({1, 1, 1}, kStart_us + 2) == PauseReason::kTwin);
  // The later ones are told when the earlier ones are over.
  CHECK(alarm.look({1, 1, 2}, kStart_us + 3) == PauseReason::kTwin);
  CHECK(alarm.look({1, 1, 2}, kStart_us + 2 + TeamAlarm::kTold_us) == PauseReason::kConflict);
}

}  // namespace
}  // namespace tessera
