// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/robot_places.hpp"

#include <algorithm>

namespace tessera {

Result<RobotPlaces> RobotPlaces::make(Arena& arena, double resolution_m) noexcept {
  RobotPlaces made;
  made.places_ = arena.take<Place>(kMost);
  made.resolution_m_ = resolution_m;
  if (made.places_.empty()) return Status::kResourceExhausted;
  return made;
}

const RobotPlaces::Place* RobotPlaces::find(std::uint32_t robot) const noexcept {
  const auto found = std::find_if(places_.begin(), places_.end(), [robot](const Place& one) {
    return one.used && one.robot == robot;
  });
  return found == places_.end() ? nullptr : &*found;
}

Result<Replicas::Change> RobotPlaces::set(std::uint32_t robot,
                                          const std::optional<Matrix34d>& T_team_world) noexcept {
  using Change = Replicas::Change;
  if (!used() || (T_team_world && check_rigid(*T_team_world) != Status::kOk))
    return Status::kInvalidArgument;
  const Place* const known = find(robot);
  if (known == nullptr && !T_team_world) return Change::kStale;
  const auto at = known != nullptr ? places_.begin() + (known - places_.data())
                                   : std::find_if(places_.begin(), places_.end(),
                                                  [](const Place& one) { return !one.used; });
  if (at == places_.end()) return Status::kResourceExhausted;
  if (known != nullptr && at->next == T_team_world) return Change::kStale;
  at->robot = robot;
  at->used = true;
  at->next = T_team_world;
  waits_ = true;
  return Change::kTaken;
}

void RobotPlaces::begin() noexcept {
  waits_ = false;
  for (Place& one : places_) {
    // What was moved and moved back is not moved.
    if (!one.used || one.next == one.to.T_team_world) continue;
    one.to.T_team_world = one.next;
    one.to.number = one.next ? ++numbers_ : 0;
  }
}

void RobotPlaces::settle() noexcept {
  for (Place& one : places_) {
    if (!one.used) continue;
    one.now = one.to;
    if (!one.now.T_team_world && !one.next) one = {};
  }
}

RobotPlaces::Placed RobotPlaces::placed(const World& world, const ContributionId& id,
                                        const GridTransform& T_world_local) const noexcept {
  if (!used()) return {.T_global_local = T_world_local};
  Placed result{
      .T_global_local = T_world_local, .hidden = !world.T_team_world, .place = world.number};
  if (result.hidden || !has_blocks(id)) return result;
  const Result<GridTransform> T_global_local =
      GridTransform::compose(*world.T_team_world, T_world_local, resolution_m_);
  result.hidden = !T_global_local.ok();
  if (!result.hidden) result.T_global_local = *T_global_local;
  return result;
}

}  // namespace tessera
