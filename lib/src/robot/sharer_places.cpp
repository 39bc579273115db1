// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where this robot and the others are.
#include "tessera/base/rigid.hpp"
#include "tessera/frames/frame_statements.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera {

namespace {

Point3d direction_in_team(const Matrix34d& T, const Point3d& way) noexcept {
  return apply(T, way) - Point3d(T.col(3));
}

}  // namespace

void Sharer::note_place(std::uint32_t submap, std::int64_t stamp_us, const Matrix34d& T_map_body,
                        std::int64_t now_us) noexcept {
  if (!tells_place_) return;
  const Matrix34d T_global_map = frames_.has(submap) ? frame_of(submap) : frame_;
  exchange_.note_place(product(T_global_map, T_map_body), stamp_us, now_us);
}

Matrix34d Sharer::map_from_global(std::uint32_t submap) const noexcept {
  const Matrix34d T_world_map = frames_.has(submap) ? frame_of(submap) : frame_;
  return inverse(shared_ != nullptr ? product(shared_->own_frame(), T_world_map) : T_world_map);
}

std::size_t Sharer::teammates(std::int64_t now_us) const noexcept {
  std::size_t count = 0;
  for (const Teammate& one : exchange_.teammates().all()) {
    const bool is_here = Teammates::is_here(one, Instant::at_us(now_us));
    count += is_here && is_placed(one.robot) ? 1U : 0U;
  }
  return count;
}

bool Sharer::is_placed(std::uint32_t robot) const noexcept {
  return shared_ != nullptr ? shared_->frame_of(robot) != nullptr : !global_.is_left_out(robot);
}

void Sharer::leave_out_other_worlds() noexcept {
  const Replicas& replicas = global_.replicas();
  if (replicas.frame_changes() == statements_seen_) return;
  statements_seen_ = replicas.frame_changes();
  const auto is_own_world = [&](Replicas::Slot slot) {
    const Result<StatedPrior> prior = read_prior(replicas, slot);
    return prior.ok() && prior->kind != PriorKind::kExact;
  };
  // By ascending robots and epochs: of each robot the last one counts. A refusal is of a robot
  // beyond those that can have a place, which the replicas do not hold either.
  const auto states_own_world = [&](std::uint32_t robot) {
    bool is_own = false;
    for (const Replicas::Slot slot : replicas.in_order()) {
      const Replicas::Contribution& one = replicas.contribution(slot);
      if (one.id.robot == robot && FrameStatements::is(one.id.submap) && !one.leaving)
        is_own = is_own_world(slot);
    }
    return is_own;
  };
  for (std::optional<std::uint32_t> robot = global_.next_left_out(0); robot;
       robot = global_.next_left_out(*robot + 1)) {
    if (!states_own_world(*robot))
      static_cast<void>(global_.place(*robot, Matrix34d(Matrix34d::Identity())));
    if (*robot == ~std::uint32_t{0}) break;
  }
  for (const Replicas::Slot slot : replicas.in_order()) {
    const ContributionId& id = replicas.contribution(slot).id;
    if (FrameStatements::is(id.submap) && states_own_world(id.robot))
      static_cast<void>(global_.place(id.robot, std::nullopt));
  }
}

Result<TeammatePlace> Sharer::teammate_at(std::size_t index, std::int64_t now_us) const noexcept {
  const Teammates& heard = exchange_.teammates();
  // Each says where it is in its own world; of who is not placed nobody knows.
  for (std::size_t i = 0;; ++i) {
    Result<TeammatePlace> one = heard.at(i, teammate_margin_m_, Instant::at_us(now_us));
    if (!one.ok()) return one;
    if (!is_placed(one->robot) || index-- != 0) continue;
    if (shared_ == nullptr) return one;
    const Matrix34d* const T_team_world = shared_->frame_of(one->robot);
    one->T_map_body = product(*T_team_world, one->T_map_body);
    one->velocity = direction_in_team(*T_team_world, one->velocity);
    return one;
  }
}

std::size_t Sharer::place_teammates(std::uint32_t submap, std::int64_t now_us,
                                    std::span<PlacedBox> into) const noexcept {
  std::size_t count = 0;
  const Matrix34d T = map_from_global(submap);
  while (count < into.size()) {
    Result<TeammatePlace> one = teammate_at(count, now_us);
    if (!one.ok()) break;
    one->T_map_body = product(T, one->T_map_body);
    into[count++] = one->placed_box();
  }
  return count;
}

void Sharer::object(LocalMaps& maps) noexcept {
  // While robots move, the frames of some are those of before.
  if (!has_place_ || (shared_ != nullptr && global_.moving())) return;
  const std::optional<ContributionId> own = exchange_.publishing();
  if (!own) return;
  const Matrix34d T_global_map =
      shared_ != nullptr ? product(shared_->own_frame(), frame_) : frame_;
  objections_.tick({maps.of(submap_.submap), *own, T_global_map, places_.front()});
}

}  // namespace tessera
