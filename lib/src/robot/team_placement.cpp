// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/internal/team_placement.hpp"

#include <algorithm>

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// Of each robot those of its newest epochs are held.
constexpr std::size_t stated_priors(const FramesConfig& config) noexcept {
  return std::size_t{FrameStatements::kPlacesOfRobot} * config.most_robots;
}

}  // namespace

std::size_t TeamPlacement::required_bytes(const FramesConfig& config) noexcept {
  const std::uint32_t robots = config.most_robots;
  const std::uint32_t links = config.most_links();
  return TeamFrames::required_bytes(robots, links) + 2 * arena_bytes<PlacedRobot>(robots) +
         arena_bytes<FrameMember>(robots) + arena_bytes<FrameLink>(links) +
         arena_bytes<FrameLinkReport>(links) + arena_bytes<FramePrior>(robots) +
         arena_bytes<StatedPrior>(stated_priors(config));
}

Result<TeamPlacement> TeamPlacement::make(Arena& arena, const FramesConfig& config) noexcept {
  const std::uint32_t robots = config.most_robots;
  const std::uint32_t links = config.most_links();
  TeamPlacement all;
  const Result<TeamFrames> team = TeamFrames::make(arena, robots, links);
  if (!team.ok()) return team.status();
  all.team_ = *team;
  all.robots_ = arena.take<PlacedRobot>(robots);
  all.next_ = arena.take<PlacedRobot>(robots);
  all.members_ = arena.take<FrameMember>(robots);
  all.links_ = arena.take<FrameLink>(links);
  all.verdicts_ = arena.take<FrameLinkReport>(links);
  all.priors_ = arena.take<FramePrior>(robots);
  all.stated_ = arena.take<StatedPrior>(stated_priors(config));
  if (all.stated_.size() != stated_priors(config)) return Status::kResourceExhausted;
  return all;
}

const PlacedRobot* TeamPlacement::find(std::uint32_t robot) const noexcept {
  for (const PlacedRobot& one : robots())
    if (one.robot == robot) return &one;
  return nullptr;
}

const Matrix34d* TeamPlacement::placed(std::uint32_t robot) const noexcept {
  const PlacedRobot* const one = find(robot);
  return one != nullptr && one->follower.in_use() ? &one->follower.frame() : nullptr;
}

bool TeamPlacement::busy() const noexcept {
  return std::ranges::any_of(robots(), [](const PlacedRobot& one) {
    return one.follower.in_use() && !one.follower.arrived();
  });
}

bool TeamPlacement::collect(const Exchange& exchange, const GlobalMap& global) noexcept {
  const std::optional<ContributionId> own = exchange.publishing();
  const std::uint64_t changes = global.replicas().frame_changes();
  if (!own || (changes == seen_ && own->robot == own_)) return false;
  seen_ = changes;
  own_ = own->robot;
  const CollectedStatements found = tessera::collect(global.replicas(), links_, stated_);
  link_count_ = found.links;
  stated_count_ = found.priors;
  report_.refused_links = std::max<std::uint64_t>(report_.refused_links, found.links_left_out);
  // In the order of robots and epochs: of each robot the last one counts.
  member_count_ = prior_count_ = 0;
  std::uint64_t refused = found.priors_left_out;
  for (std::size_t i = 0; i < found.priors; ++i) {
    if (i + 1 < found.priors && stated_[i + 1].robot == stated_[i].robot) continue;
    if (member_count_ == members_.size()) {
      ++refused;
      continue;
    }
    members_[member_count_++] = {stated_[i].robot, stated_[i].epoch};
    if (const std::optional<FramePrior> prior = prior_of(stated_[i]); prior)
      priors_[prior_count_++] = *prior;
  }
  report_.refused_robots = std::max(report_.refused_robots, refused);
  return true;
}

void TeamPlacement::tick(const Exchange& exchange, GlobalMap& global, const Point3d& p_world,
                         Instant now) noexcept {
  if (now >= due_ && collect(exchange, global)) {
    due_ = now + kPause;
    solve(own_, global);
  }
  if (const auto own = exchange.publishing(); own && count_ == 0)
    static_cast<void>(global.place(own->robot, T_team_own_));
  leave_out_new_epochs(global);
  move(exchange, global, p_world, now);
}

void TeamPlacement::solve(std::uint32_t own, GlobalMap& global) noexcept {
  const Result<TeamSolution> solution = team_.solve(
      links_.first(link_count_), priors_.first(prior_count_), members_.first(member_count_));
  if (!solution.ok()) {  // a statement that nobody can compute with
    ++report_.refused_frames;
    link_count_ = 0;
    return keep_alone(own, global);
  }
  ++report_.solved;
  report_.digest = solution->digest;
  std::copy(solution->links.begin(), solution->links.end(), verdicts_.begin());
  take(*solution, own, global);
}

bool TeamPlacement::stays(const PlacedRobot& one) const noexcept {
  return std::ranges::any_of(members_.first(member_count_), [&](const FrameMember& member) {
    return member.robot == one.robot && member.epoch == one.epoch;
  });
}

void TeamPlacement::take(const TeamSolution& solution, std::uint32_t own,
                         GlobalMap& global) noexcept {
  const auto mine = std::ranges::find(solution.frames, own, &RobotFrame::robot);
  if (mine == solution.frames.end()) return keep_alone(own, global);
  // Another anchor is another frame: what is in use ends first, and all begin there at once. Where
  // users gave frames, theirs is the team's, whoever of them is there.
  const std::uint32_t anchor_epoch = epoch_of(mine->anchor);
  const bool is_other = mine->anchored_by == FrameAnchor::kLowestRobot &&
                        (mine->anchor != anchor_ || anchor_epoch != anchor_epoch_);
  const bool rebased = count_ != 0 && (mine->anchored_by != anchored_by_ || is_other);
  anchored_by_ = mine->anchored_by;
  anchor_ = mine->anchor;
  anchor_epoch_ = anchor_epoch;
  report_.rebased += rebased ? 1U : 0U;
  for (PlacedRobot& one : robots_.first(count_))
    if (rebased || !stays(one)) withdraw(one, global);
  std::size_t count = 0;
  for (const RobotFrame& frame : solution.frames) {
    PlacedRobot& one = next_[count++];
    const PlacedRobot* const known = find(frame.robot);
    one = known != nullptr ? *known : PlacedRobot{};
    one.robot = frame.robot;
    one.epoch = epoch_of(frame.robot);
    one.frame = frame;
    follow(one, frame.group == mine->group, global);
  }
  std::swap(robots_, next_);
  count_ = count;
  note_own(own);
}

void TeamPlacement::follow(PlacedRobot& one, bool is_joined, GlobalMap& global) noexcept {
  if (!is_joined) return withdraw(one, global);
  const bool at_once = !one.follower.in_use() || one.frame.state == FrameState::kGiven;
  const Status status = at_once ? one.follower.use_at_once(one.frame.T_team_robot)
                                : one.follower.follow(one.frame.T_team_robot);
  report_.refused_frames += status == Status::kOk ? 0U : 1U;
  if (at_once && status == Status::kOk) place(one, global);
}

void TeamPlacement::withdraw(PlacedRobot& one, GlobalMap& global) noexcept {
  if (!one.follower.in_use()) return;
  one.follower.withdraw();
  ++report_.withdrawals;
  static_cast<void>(global.place(one.robot, std::nullopt));
}

void TeamPlacement::place(const PlacedRobot& one, GlobalMap& global) noexcept {
  report_.refused_frames += global.place(one.robot, one.follower.frame()).ok() ? 0U : 1U;
}

std::uint32_t TeamPlacement::epoch_of(std::uint32_t robot) const noexcept {
  for (const FrameMember& member : members_.first(member_count_))
    if (member.robot == robot) return member.epoch;
  return 0;
}

void TeamPlacement::keep_alone(std::uint32_t own, GlobalMap& global) noexcept {
  for (PlacedRobot& one : robots_.first(count_)) withdraw(one, global);
  count_ = 0;
  T_team_own_ = Matrix34d::Identity();
  static_cast<void>(global.place(own, T_team_own_));
}

void TeamPlacement::leave_out_new_epochs(GlobalMap& global) noexcept {
  const Replicas& replicas = global.replicas();
  PlacedRobot* one = robots_.data();
  PlacedRobot* const end = one + count_;
  for (const Replicas::Slot slot : replicas.in_order()) {  // both by ascending robots
    const ContributionId& id = replicas.contribution(slot).id;
    while (one != end && one->robot < id.robot) ++one;
    if (one == end) return;
    const bool is_new = one->robot == id.robot && id.epoch > one->epoch && is_map(id);
    if (is_new && one->robot != own_) withdraw(*one, global);
  }
}

PriorKind TeamPlacement::prior_kind(std::uint32_t robot) const noexcept {
  for (const StatedPrior& one : stated_.first(stated_count_))
    if (one.robot == robot && one.epoch == epoch_of(robot)) return one.kind;
  return PriorKind::kUnknown;
}

bool TeamPlacement::is_sure(std::uint32_t robot) const noexcept {
  const PlacedRobot* const one = find(robot);
  return one != nullptr && one->follower.in_use() && one->frame.state != FrameState::kOnlyByOne;
}

void TeamPlacement::note_own(std::uint32_t own) noexcept {
  const PlacedRobot* const one = find(own);
  if (one != nullptr && one->follower.in_use()) T_team_own_ = one->follower.frame();
}

/// No step while the one before is under way in the global map: what is seen moves by one at most.
void TeamPlacement::move(const Exchange& exchange, GlobalMap& global, const Point3d& p_world,
                         Instant now) noexcept {
  if (!busy() || global.moving()) return;
  for (PlacedRobot& one : robots_.first(count_)) {
    // Who was never heard is taken to be where its world begins.
    Point3d p_robot = Point3d::Zero();
    for (const Teammate& heard : exchange.teammates().all())
      if (heard.robot == one.robot) p_robot = heard.presence.T_global_body.col(3);
    // What it claims holds nobody up: beyond that, a degree would take hundreds of steps.
    constexpr double kFarthest_m = 1'000.0;
    p_robot = p_robot.cwiseMin(kFarthest_m).cwiseMax(-kFarthest_m);
    if (!one.follower.step(one.robot == own_ ? p_world : p_robot, now)) continue;
    ++report_.steps;
    place(one, global);
  }
  note_own(own_);
}

}  // namespace tessera
