// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/internal/link_maker.hpp"

#include <algorithm>

#include "tessera/base/internal/put_in_place.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/frames/answer_link.hpp"

namespace tessera {

Status LinkMaker::set_up(Arena& arena, const FramesConfig& config, const GlobalMapConfig& global,
                         const ClassTable& classes) noexcept {
  config_ = config;
  const auto source = [&] {
    return ReplicaSketchSource::make(arena, global.map, classes, global.replicas);
  };
  Status status = FrameFinder::make_at(finder_, arena);
  if (status == Status::kOk) status = put_in_place(source_a_, source);
  if (status == Status::kOk) status = put_in_place(source_b_, source);
  if (status != Status::kOk) return status;
  pairs_ = arena.take<PairState>(config.most_robots);
  return pairs_.size() == config.most_robots ? Status::kOk : Status::kResourceExhausted;
}

PairState* LinkMaker::place_for_pair(const TeamPlacement& placement) noexcept {
  if (count_ != pairs_.size()) return &pairs_[count_++];
  for (std::size_t i = 0; i < count_; ++i) {
    const bool is_there = std::ranges::any_of(
        placement.robots(), [&](const PlacedRobot& one) { return one.robot == pairs_[i].robot; });
    if (!is_there && at_ != i) return &pairs_[i];
  }
  return nullptr;
}

/// Pairs are those of the robots that are placed, or could be.
void LinkMaker::note_robots(const TeamPlacement& placement, std::uint32_t own,
                            std::uint32_t epoch) noexcept {
  for (const PlacedRobot& robot : placement.robots()) {
    if (robot.robot == own) continue;
    PairState* pair = nullptr;
    for (PairState& one : pairs_.first(count_))
      if (one.robot == robot.robot) pair = &one;
    if (pair != nullptr && pair->epoch == robot.epoch && pair->own_epoch == epoch) continue;
    // A robot that started anew has another map, and a link begins anew, with a later revision.
    const std::uint32_t revision = pair != nullptr ? pair->link.revision : 0;
    if (pair == nullptr) pair = place_for_pair(placement);
    if (pair == nullptr) continue;
    *pair = PairState{};
    pair->robot = robot.robot;
    pair->epoch = robot.epoch;
    pair->own_epoch = epoch;
    pair->link.revision = revision;
  }
}

void LinkMaker::tick(Exchange& exchange, const GlobalMap& global, const TeamPlacement& placement,
                     Instant now) noexcept {
  const std::optional<ContributionId> publishing = exchange.publishing();
  if (!publishing) return;
  note_robots(placement, publishing->robot, publishing->epoch);
  follow_corrections(global);
  state(exchange, now);
  if (at_) return;
  for (std::size_t i = 0; i < count_; ++i) {
    PairState& pair = pairs_[(next_ + i) % count_];
    const std::optional<Comparison> comparison =
        due(pair, global.replicas(), publishing->robot, now);
    if (!comparison) continue;
    next_ = (next_ + i + 1) % count_;
    begin(pair, global, placement, *comparison);
    return;
  }
}

void LinkMaker::follow_corrections(const GlobalMap& global) noexcept {
  const Replicas& replicas = global.replicas();
  const double resolution_m = global.config().map.resolution_m;
  for (PairState& pair : pairs_.first(count_)) {
    if (!pair.stated) continue;
    const Result<Replicas::Slot> own = replicas.find(pair.own_id);
    const Result<Replicas::Slot> other = replicas.find(pair.other_id);
    if (!own.ok() || !other.ok()) continue;
    const Matrix34d T_own = replicas.contribution(*own).T_world_local.in_metres(resolution_m);
    const Matrix34d T_other = replicas.contribution(*other).T_world_local.in_metres(resolution_m);
    if (T_own == pair.T_world_own && T_other == pair.T_world_other) continue;
    pair.T_world_own = T_own;
    pair.T_world_other = T_other;
    renew(pair, link_of(pair.answer, T_own, T_other));
  }
  if (!at_) return;
  const Replicas::Contribution& own = replicas.contribution(own_.slot);
  const Replicas::Contribution& other = replicas.contribution(other_.slot);
  if (!own.present || own.id != own_.id || !other.present || other.id != other_.id) return;
  T_world_a_ = own.T_world_local.in_metres(resolution_m);
  T_world_b_ = other.T_world_local.in_metres(resolution_m);
}

void LinkMaker::begin(PairState& pair, const GlobalMap& global, const TeamPlacement& placement,
                      const Comparison& comparison) noexcept {
  own_ = comparison.own;
  other_ = comparison.other;
  const Replicas& replicas = global.replicas();
  const double resolution_m = global.config().map.resolution_m;
  T_world_a_ = replicas.contribution(own_.slot).T_world_local.in_metres(resolution_m);
  T_world_b_ = replicas.contribution(other_.slot).T_world_local.in_metres(resolution_m);
  is_of_link_ = pair.stated && own_.id == pair.own_id && other_.id == pair.other_id;
  if (is_of_link_) pair.compared = comparison.segments();
  ++pair.attempts;
  refines_ = is_refined(pair);
  const FrameQuestion asked = question(pair, placement);
  is_near_ = asked.is_guess;
  Status status = source_a_.begin(replicas, own_.slot);
  if (status == Status::kOk) status = source_b_.begin(replicas, other_.slot);
  if (status == Status::kOk) status = finder_.begin(source_a_.source(), source_b_.source(), asked);
  if (status == Status::kOk)
    at_ = static_cast<std::size_t>(&pair - pairs_.data());
  else
    ++pair.turn;
}

bool LinkMaker::step(Instant now) noexcept {
  if (!at_) return false;
  if (!finder_.step()) return true;
  PairState& pair = pairs_[*at_];
  at_.reset();
  if (pair.epoch != other_.id.epoch || pair.own_epoch != own_.id.epoch) return true;  // it is anew
  if (source_a_.lost() || source_b_.lost()) {  // as if it had not begun
    pair.compared = 0;
    --pair.attempts;
    pair.due = now + kRetry;
    return true;
  }
  take(pair, now);
  return true;
}

void LinkMaker::take(PairState& pair, Instant now) noexcept {
  const FrameAnswer& answer = finder_.answer();
  const bool is_found = answer.verdict == FrameVerdict::kFound;
  pair.in_doubt = refines_ && !(is_found && is_where_stated(pair));
  if (pair.in_doubt) return;  // what a search says counts
  pair.verdict = answer.verdict;
  pair.support = answer.support;
  pair.agreement = answer.agreement;
  pair.sigma_m = answer.worst_sigma_m;
  pair.sigma_rad = answer.worst_sigma_rad;
  ++pair.search.refinements;
  const std::uint64_t compared = Comparison{own_, other_}.segments();
  if (!refines_) {
    pair.search = {.compared = compared, .own_id = own_.id, .other_id = other_.id};
    pair.support_second = answer.support_second;
    pair.agreement_second = answer.agreement_second;
  }
  const bool was_stated = pair.stated;
  is_found ? accept(pair) : refuse(pair, answer.verdict);
  pair.due = now + (pair.stated ? kRecheck : kRetry);
  if (pair.stated && (is_of_link_ || is_found)) {
    pair.compared = compared;
  } else if (!is_of_link_) {
    pair.is_wide = is_near_ && !was_stated;
    pair.turn += pair.is_wide ? 0U : 1U;
  }
}

bool LinkMaker::is_where_stated(const PairState& pair) const noexcept {
  if (!pair.stated) return true;
  const LinkMotion motion =
      motion_between(pair.link, link_of(finder_.answer(), T_world_a_, T_world_b_));
  return motion.shift_m <= kElsewhere_m && motion.chord_rad <= kElsewhere_rad;
}

void LinkMaker::accept(PairState& pair) noexcept {
  FrameLink link = link_of(finder_.answer(), T_world_a_, T_world_b_);
  if (!is_where_stated(pair)) return refuse(pair, FrameVerdict::kContradicted);
  pair.own_id = own_.id;
  pair.other_id = other_.id;
  pair.T_world_own = T_world_a_;
  pair.T_world_other = T_world_b_;
  pair.answer = finder_.answer();
  pair.refusals = 0;
  if (pair.stated) {
    const LinkMotion motion = motion_between(pair.link, link);
    if (motion.shift_m < kWorth_m && motion.chord_rad < kWorth_rad) return;
  }
  link.from = own_.id.robot;
  link.to = other_.id.robot;
  link.from_epoch = own_.id.epoch;
  link.to_epoch = other_.id.epoch;
  link.from_version = source_a_.newest_version();
  link.to_version = source_b_.newest_version();
  link.revision = pair.link.revision;
  pair.link = link;
  renew(pair, link);
}

void LinkMaker::renew(PairState& pair, FrameLink link) noexcept {
  link.from = pair.link.from;
  link.to = pair.link.to;
  link.from_epoch = pair.link.from_epoch;
  link.to_epoch = pair.link.to_epoch;
  link.from_version = pair.link.from_version;
  link.to_version = pair.link.to_version;
  link.revision = pair.link.revision + 1;
  const Result<FrameLink> rounded = round_link(link);
  if (!rounded.ok()) return;  // so far away that nothing could be placed there
  pair.link = *rounded;
  pair.stated = true;
  pair.waits = true;
}

/// A link that was accepted says more than a later search that sees too little, until it is
/// contradicted again and again.
void LinkMaker::refuse(PairState& pair, FrameVerdict verdict) noexcept {
  pair.verdict = verdict;
  if (!pair.stated) return;
  const bool doubts = verdict == FrameVerdict::kContradicted ||
                      verdict == FrameVerdict::kNoneFits || verdict == FrameVerdict::kOutOfReach;
  // Who is merely unsure takes no contradiction back.
  pair.refusals += doubts ? 1U : 0U;
  if (pair.refusals < kMostRefusals) return;
  pair.stated = false;
  pair.refusals = 0;
  pair.compared = 0;  // all take turns again
  ++pair.link.revision;
  pair.link.withdrawn = true;
  pair.waits = true;
}

/// Withdrawals first.
void LinkMaker::state(Exchange& exchange, Instant now) noexcept {
  if (now - stated_ < kStatePause) return;
  for (const bool withdrawn : {true, false}) {
    for (PairState& pair : pairs_.first(count_)) {
      if (!pair.waits || pair.link.withdrawn != withdrawn || now < pair.state_due) continue;
      const Status status = exchange.state(pair.link).status();
      pair.no_room = status != Status::kOk && status != Status::kInvalidArgument;
      if (pair.no_room) {
        pair.state_due = now + kRetry;
        continue;
      }
      pair.waits = false;
      stated_ = now;
      return;
    }
  }
}

/// What finds no room waits for others, not they for it.
bool LinkMaker::busy() const noexcept {
  return at_ || std::ranges::any_of(pairs_.first(count_), [](const PairState& pair) {
           return pair.waits && !pair.no_room;
         });
}

}  // namespace tessera
