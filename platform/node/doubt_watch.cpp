// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/doubt_watch.hpp"

#include <algorithm>
#include <bit>

namespace tessera {

namespace {

DoubtedRobots doubted_in(const GlobalMap& global, std::int64_t now_us) noexcept {
  DoubtedRobots found;
  const Replicas& replicas = global.replicas();
  std::uint64_t last = ~std::uint64_t{0};
  for (const GlobalMap::Slot slot : replicas.in_order()) {
    const std::uint32_t robot = replicas.contribution(slot).id.robot;
    if (robot == last) continue;
    last = robot;
    const Result<RobotReliability> report = global.reliability(robot);
    if (report.ok() && report->named != 0)
      found.robots[found.count++] = {robot, report->reliability, report->named, now_us};
  }
  return found;
}

DoubtedRobots::Robot* find_in(DoubtedRobots& doubted, std::uint32_t robot) noexcept {
  for (std::uint32_t i = 0; i < doubted.count; ++i)
    if (doubted.robots[i].robot == robot) return &doubted.robots[i];
  return nullptr;
}

}  // namespace

void DoubtWatch::look(const GlobalMap& global, std::int64_t now_us, LogQueue& log) noexcept {
  // A part of what has arrived may name whom all of it does not.
  if (global.busy() && now_us - looked_us_ < kPatience_us) return;
  looked_us_ = now_us;
  DoubtedRobots now = doubted_in(global, now_us);
  for (std::uint32_t i = 0; i < now.count; ++i) {
    DoubtedRobots::Robot& one = now.robots[i];
    const DoubtedRobots::Robot* const before = find_in(last_, one.robot);
    const std::uint64_t told = before != nullptr ? before->classes : 0;
    if ((one.classes & ~told) != 0)
      log.say_change(LogLevel::kWarning, now_us,
                     "robot %: most other robots contradict % of its classes; its network or its "
                     "class table may be wrong",
                     one.robot, std::popcount(one.classes));
    one.classes |= told;
  }
  for (const DoubtedRobots::Robot& one : last_.all()) {
    if (find_in(now, one.robot) != nullptr) continue;
    if (now_us - one.named_us < kMemory_us && now.count < now.robots.size()) {
      now.robots[now.count++] = one;
    } else {
      log.say_change(LogLevel::kInfo, now_us, "robot % is not contradicted any more", one.robot);
    }
  }
  std::ranges::sort(std::span(now.robots).first(now.count), {}, &DoubtedRobots::Robot::robot);
  last_ = now;
  view_.set(now);
}

}  // namespace tessera
