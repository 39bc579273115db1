// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/epoch_floors.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// Epochs that a robot goes up at once by what nobody has signed.
constexpr std::uint32_t kMostEpochs = 1U << 16U;
/// Claims of floors that one process follows at once: some robots may know of higher ones than
/// others. Whoever made some up keeps it from the true one for no longer than this.
constexpr std::uint32_t kMostClaimsOfFloors = 3;
constexpr Duration kBetweenClaims{20'000'000};

}  // namespace

Result<EpochFloors> EpochFloors::make(Arena& arena, const ExchangeConfig& config,
                                      bool signs) noexcept {
  EpochFloors made;
  made.robot_ = config.robot;
  made.signs_ = signs;
  made.floors_ = arena.take<RobotFloor>(config.peers + 1);
  made.session_floors_ = arena.take<std::uint32_t>(config.peers + 1);
  if (made.session_floors_.empty()) return Status::kResourceExhausted;
  return made;
}

std::uint32_t EpochFloors::of(std::uint32_t robot) const noexcept {
  if (robot == robot_) return own_floor_;
  for (const RobotFloor& known : all()) {
    if (known.robot == robot) return known.floor;
  }
  return 0;
}

std::uint32_t EpochFloors::of_sessions(std::uint32_t robot) const noexcept {
  if (robot == robot_) return own_session_floor_;
  for (std::size_t i = 0; i < count_; ++i) {
    if (floors_[i].robot == robot) return session_floors_[i];
  }
  return 0;
}

std::uint32_t EpochFloors::of(const ContributionId& id) const noexcept {
  const std::uint32_t floor = of(id.robot);
  return MapSession::is(id.submap) ? std::max(floor, of_sessions(id.robot)) : floor;
}

/// Where there is no place, a robot of which nothing is held gives its own.
RobotFloor* EpochFloors::place_of(std::uint32_t robot, const ContributionTable& held) noexcept {
  const auto known = floors_.first(count_);
  for (RobotFloor& one : known) {
    if (one.robot == robot) return &one;
  }
  if (count_ < floors_.size()) return &floors_[count_++];
  for (RobotFloor& one : known) {
    if (!held.has_any_of(one.robot)) return &one;
  }
  return nullptr;
}

bool EpochFloors::note(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                       const ContributionTable& held) noexcept {
  const std::uint32_t known = of(robot);
  if (robot == robot_ || floor == known || (floor < known && !may_fall)) return false;
  RobotFloor* const place = place_of(robot, held);
  if (place == nullptr) return false;
  if (place->robot != robot) session_floors_[static_cast<std::size_t>(place - floors_.data())] = 0;
  *place = {robot, floor};
  return true;
}

bool EpochFloors::note_sessions(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                                const ContributionTable& held) noexcept {
  const std::uint32_t known = of_sessions(robot);
  if (robot == robot_ || floor == known || (floor < known && !may_fall)) return false;
  RobotFloor* const place = place_of(robot, held);
  if (place == nullptr) return false;
  if (place->robot != robot) *place = {robot, 0};
  session_floors_[static_cast<std::size_t>(place - floors_.data())] = floor;
  return true;
}

bool EpochFloors::note_statement(const Statement& statement, std::uint64_t session,
                                 const HeldContribution* stated,
                                 const HeldContribution* published) noexcept {
  if (statement.session == session) {
    // Without signatures others can say it too: it is theirs if this process has not come to it.
    const bool is_ours = stated == nullptr ? statement.id.epoch < first_epoch_
                                           : !stated->own || statement.latest <= stated->latest;
    if (is_ours) return false;
  } else {
    highest_session_ = std::max(highest_session_, statement.session);
    if (statement.id.epoch < first_epoch_ && statement.floor <= own_floor_) return false;
  }
  const std::uint32_t epoch = std::max(statement.id.epoch, statement.floor);
  // Where nobody signs, the others forget it when they hear this robot.
  if (!signs_ && !may_rise_to(epoch, published)) return false;
  overtake(epoch);
  return true;
}

/// Nobody has signed that there is such an epoch.
bool EpochFloors::may_rise_to(std::uint32_t epoch,
                              const HeldContribution* published) const noexcept {
  const std::uint32_t own_epoch = published == nullptr ? own_floor_ : published->id.epoch;
  return epoch <= own_epoch || epoch - own_epoch <= kMostEpochs;
}

void EpochFloors::note_claim(std::uint32_t floor, const HeldContribution* published,
                             Instant now) noexcept {
  if (published == nullptr || floor <= published->id.epoch || !may_rise_to(floor, published) ||
      (overtaken_ && floor <= *overtaken_))
    return;
  // One that is still to be followed may rise: the true one may come after one that is lower.
  if (!overtaken_) {
    if (claims_ >= kMostClaimsOfFloors && now - claimed_ < kBetweenClaims) return;
    ++claims_;
    claimed_ = now;
  }
  overtake(floor);
}

}  // namespace tessera
