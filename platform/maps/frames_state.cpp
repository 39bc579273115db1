// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/frames_state.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "maps/frame_run.hpp"

namespace tessera {

namespace {

/// The robots without which one would not be joined.
std::vector<std::uint32_t> only_by(const FramesState& state, const FramesState::Robot& robot) {
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < state.robot_count; ++i)
    if ((robot.joined_by >> i & 1U) != 0) numbers.push_back(state.robots[i].robot);
  return numbers;
}

Json to_json(const FramesState& state, const FramesState::Robot& robot) {
  return {{"robot", robot.robot},
          {"group", robot.group},
          {"anchor", robot.anchor},
          {"anchored_by", to_string(robot.anchored_by)},
          {"state", to_string(robot.state)},
          {"suspected", robot.suspected},
          {"in_use", robot.in_use},
          {"arrived", robot.arrived},
          {"only_by", only_by(state, robot)},
          {"T_team_map", robot.T_team_world},
          {"sigma_m", robot.sigma_m},
          {"sigma_deg", degrees_of(robot.sigma_rad)}};
}

Json to_json(const FramesState::Link& link) {
  return {{"from", link.from},
          {"to", link.to},
          {"verdict", to_string(link.verdict)},
          {"confirmed", link.confirmed},
          {"sigmas", link.compared ? Json(link.sigmas) : Json()}};
}

Json to_json(const FramesState::Pair& pair) {
  return {{"robot", pair.robot},
          {"attempts", pair.attempts},
          {"result", pair.attempts == 0 ? "not compared yet" : to_string(pair.verdict)},
          {"stated", pair.stated},
          {"support", pair.support},
          {"support_second", pair.support_second},
          {"agreement", to_json(pair.agreement)},
          {"agreement_second", to_json(pair.agreement_second)},
          {"sigma_m", pair.sigma_m},
          {"sigma_deg", degrees_of(pair.sigma_rad)}};
}

}  // namespace

const char* to_string(FrameState state) noexcept {
  switch (state) {
    case FrameState::kGiven:
      return "given";
    case FrameState::kPlaced:
      return "given roughly";
    case FrameState::kLinked:
      return "linked";
    case FrameState::kOnlyByOne:
      return "linked by one robot alone";
    case FrameState::kAlone:
      return "alone";
    case FrameState::kWithdrawn:
      return "withdrawn";
    case FrameState::kContradicted:
      return "contradicted";
  }
  return "";
}

const char* to_string(FrameAnchor anchor) noexcept {
  switch (anchor) {
    case FrameAnchor::kExactPrior:
      return "exact frame";
    case FrameAnchor::kVaguePrior:
      return "rough frame";
    case FrameAnchor::kLowestRobot:
      return "lowest robot";
  }
  return "";
}

const char* to_string(LinkVerdict verdict) noexcept {
  switch (verdict) {
    case LinkVerdict::kUsed:
      return "used";
    case LinkVerdict::kNotNeeded:
      return "not needed";
    case LinkVerdict::kReplaced:
      return "replaced";
    case LinkVerdict::kWithdrawn:
      return "withdrawn";
    case LinkVerdict::kNotMember:
      return "of no member";
    case LinkVerdict::kOtherEpoch:
      return "of another epoch";
    case LinkVerdict::kInvalid:
      return "invalid";
    case LinkVerdict::kTwoContents:
      return "two contents";
    case LinkVerdict::kContradicted:
      return "contradicted";
    case LinkVerdict::kAuthorRefused:
      return "its author is refused";
    case LinkVerdict::kAgainstPriors:
      return "against given frames";
  }
  return "";
}

std::optional<Matrix34d> T_team_world(const FramesState& state, std::uint32_t robot) noexcept {
  for (const FramesState::Robot& one : std::span(state.robots).first(state.robot_count)) {
    if (one.robot != robot || !one.in_use) continue;
    Matrix34d T;
    std::copy(one.T_team_world.begin(), one.T_team_world.end(), T.data());
    return T;
  }
  return std::nullopt;
}

void FramesState::take(const SharedFrames& frames) noexcept {
  mode = frames.config().mode;
  joined = frames.is_joined();
  report = frames.report();
  robot_count = link_count = pair_count = 0;
  for (const PlacedRobot& one : frames.robots()) {
    if (robot_count == robots.size()) break;
    Robot& robot = robots[robot_count++];
    robot = {.robot = one.robot,
             .group = one.frame.group,
             .anchor = one.frame.anchor,
             .anchored_by = one.frame.anchored_by,
             .state = one.frame.state,
             .suspected = one.frame.suspected,
             .in_use = one.follower.in_use(),
             .arrived = one.follower.arrived(),
             .joined_by = one.frame.joined_by,
             .sigma_m = one.frame.covariance.sigma_m(),
             .sigma_rad = one.frame.covariance.sigma_rad()};
    std::copy_n(one.follower.frame().data(), 12, robot.T_team_world.begin());
  }
  for (std::size_t i = 0; i < frames.links().size() && link_count < links.size(); ++i) {
    const FrameLink& link = frames.links()[i];
    const FrameLinkReport& verdict = frames.verdicts()[i];
    links[link_count++] = {link.from,         link.to,          verdict.verdict,
                           verdict.confirmed, verdict.compared, verdict.sigmas};
  }
  for (const PairState& one : frames.pairs()) {
    if (pair_count == pairs.size()) break;
    pairs[pair_count++] = {.robot = one.robot,
                           .attempts = one.attempts,
                           .verdict = one.verdict,
                           .stated = one.stated,
                           .support = one.support,
                           .support_second = one.support_second,
                           .agreement = one.agreement,
                           .agreement_second = one.agreement_second,
                           .sigma_m = one.sigma_m,
                           .sigma_rad = one.sigma_rad};
  }
}

void FramesState::take_given(const Replicas& replicas, std::uint32_t own_robot) noexcept {
  left_out_by = 0;
  std::optional<std::uint32_t> last;
  for (const Replicas::Slot slot : replicas.in_order()) {
    const Replicas::Contribution& one = replicas.contribution(slot);
    const bool states_frames = FrameStatements::is(one.id.submap) && !one.leaving;
    if (!states_frames || one.id.robot == own_robot || one.id.robot == last) continue;
    last = one.id.robot;
    ++left_out_by;
  }
}

Json to_json(const FramesState& state) {
  if (state.mode == FrameMode::kGiven)
    return {{"mode", to_string(state.mode)}, {"left_out_by", state.left_out_by}};
  Json json = {{"mode", to_string(state.mode)},
               {"solved", state.report.solved},
               {"withdrawals", state.report.withdrawals},
               {"rebased", state.report.rebased},
               {"steps", state.report.steps},
               {"refused_robots", state.report.refused_robots},
               {"refused_links", state.report.refused_links},
               {"refused_frames", state.report.refused_frames}};
  Json& robots = json["robots"] = Json::array();
  for (std::uint32_t i = 0; i < state.robot_count; ++i)
    robots.push_back(to_json(state, state.robots[i]));
  Json& links = json["links"] = Json::array();
  for (std::uint32_t i = 0; i < state.link_count; ++i) links.push_back(to_json(state.links[i]));
  Json& pairs = json["pairs"] = Json::array();
  for (std::uint32_t i = 0; i < state.pair_count; ++i) pairs.push_back(to_json(state.pairs[i]));
  return json;
}

}  // namespace tessera
