// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/fleet_watch.hpp"

namespace tessera {

void FleetWatch::look(std::uint32_t own_digest, std::int64_t now_us, LogQueue& log) noexcept {
  FleetView view;
  view.counters = table_.counters();
  for (std::size_t i = 0; i < table_.entries().size(); ++i) {
    const StatusTable::Entry& entry = table_.entries()[i];
    const bool lately = entry.is_lately(now_us);
    const bool differs = lately && entry.status.exclude_digest != own_digest;
    // A place that was given to another robot ends the warning about the robot before.
    const bool told = differs_[i];
    const bool same_robot = told_[i] == entry.status.robot;
    if (told && !(differs && same_robot))
      log.say_change(LogLevel::kInfo, now_us,
                     lately && same_robot
                         ? "robot % excludes the same robots as this one again"
                         : "robot %, which excludes other robots than this one, is no longer heard",
                     told_[i]);
    if (differs && !(told && same_robot))
      log.say_change(
          LogLevel::kWarning, now_us,
          "robot % excludes other robots than this one; give all the same [security] exclude",
          entry.status.robot);
    differs_[i] = differs;
    told_[i] = entry.status.robot;
    if (differs) view.differing[view.differing_count++] = entry.status.robot;
  }
  view_.set(view);
}

}  // namespace tessera
