// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/doubt_watch.hpp"

#include <algorithm>
#include <bit>

namespace tessera {

namespace {

DoubtedRobots doubted_in(const GlobalMap& global) noexcept {
  DoubtedRobots found;
  const Replicas& replicas = global.replicas();
  std::uint64_t last = ~std::uint64_t{0};
  for (const GlobalMap::Slot slot : replicas.in_order()) {
    const std::uint32_t robot = replicas.contribution(slot).id.robot;
    if (robot == last) continue;
    last = robot;
    const Result<RobotReliability> report = global.reliability(robot);
    if (report.ok() && report->named != 0)
      found.robots[found.count++] = {robot, report->reliability, report->named};
  }
  return found;
}

std::uint64_t classes_in(const DoubtedRobots& doubted, std::uint32_t robot) noexcept {
  for (const DoubtedRobots::Robot& one : doubted.all())
    if (one.robot == robot) return one.classes;
  return 0;
}

}  // namespace

void DoubtWatch::look(const GlobalMap& global, std::int64_t now_us, LogQueue& log) noexcept {
  // Half of what has arrived may name whom all of it does not.
  if (global.busy()) return;
  const DoubtedRobots now = doubted_in(global);
  for (const DoubtedRobots::Robot& one : now.all()) {
    if ((one.classes & ~classes_in(last_, one.robot)) != 0)
      log.say_change(LogLevel::kWarning, now_us,
                     "robot %: % of its classes are others than most robots see there, and count "
                     "less; its network or its class table may be wrong",
                     one.robot, std::popcount(one.classes));
  }
  for (const DoubtedRobots::Robot& one : last_.all()) {
    if (classes_in(now, one.robot) == 0)
      log.say_change(LogLevel::kInfo, now_us, "robot %: its classes are as most robots see them",
                     one.robot);
  }
  last_ = now;
  view_.set(now);
}

}  // namespace tessera
