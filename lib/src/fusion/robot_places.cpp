// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/fusion/internal/robot_places.hpp"

#include <algorithm>

namespace tessera {

Result<RobotPlaces> RobotPlaces::make(Arena& arena, double resolution_m, bool as_stated) noexcept {
  RobotPlaces made;
  made.as_stated_ = as_stated;
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

bool RobotPlaces::is_left_out(std::uint32_t robot) const noexcept {
  const Place* const place = find(robot);
  return as_stated_ && place != nullptr && !place->next;
}

std::optional<std::uint32_t> RobotPlaces::next_left_out(std::uint32_t robot) const noexcept {
  std::optional<std::uint32_t> found;
  for (const Place& one : places_)
    if (as_stated_ && one.used && !one.next && one.robot >= robot && (!found || one.robot < *found))
      found = one.robot;
  return found;
}

Result<Replicas::Change> RobotPlaces::set(std::uint32_t robot,
                                          const std::optional<Matrix34d>& T_team_world) noexcept {
  using Change = Replicas::Change;
  if (!used() || (T_team_world && check_rigid(*T_team_world) != Status::kOk))
    return Status::kInvalidArgument;
  if (as_stated_ && T_team_world && *T_team_world != Matrix34d::Identity())
    return Status::kInvalidArgument;
  const World unasked = where_unasked();
  const Place* const known = find(robot);
  if (known == nullptr && T_team_world == unasked.T_team_world) return Change::kStale;
  const auto at = known != nullptr ? places_.begin() + (known - places_.data())
                                   : std::find_if(places_.begin(), places_.end(),
                                                  [](const Place& one) { return !one.used; });
  if (at == places_.end()) return Status::kResourceExhausted;
  if (known != nullptr && at->next == T_team_world) return Change::kStale;
  if (known == nullptr)
    *at = {.robot = robot, .used = true, .now = unasked, .to = unasked, .next = {}};
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
    one.to.number = one.next == where_unasked().T_team_world ? 0 : ++numbers_;
  }
}

void RobotPlaces::settle() noexcept {
  for (Place& one : places_) {
    if (!one.used) continue;
    one.now = one.to;
    const std::optional<Matrix34d> unasked = where_unasked().T_team_world;
    if (one.now.T_team_world == unasked && one.next == unasked) one = {};
  }
}

RobotPlaces::Placed RobotPlaces::placed(const World& world, const ContributionId& id,
                                        const GridTransform& T_world_local) const noexcept {
  if (!used() || (as_stated_ && world.T_team_world)) return {.T_global_local = T_world_local};
  Placed result{.T_global_local = T_world_local,
                .hidden = !world.T_team_world,
                .place = world.T_team_world ? world.number : 0};
  if (result.hidden || !has_blocks(id)) return result;
  const Result<GridTransform> T_global_local =
      GridTransform::compose(*world.T_team_world, T_world_local, resolution_m_);
  result.hidden = !T_global_local.ok();
  if (!result.hidden) result.T_global_local = *T_global_local;
  return result;
}

}  // namespace tessera
