// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a link maker compares next, and what it asks.
#include "tessera/base/assert.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/frames/search_reach.hpp"
#include "tessera/robot/internal/link_maker.hpp"

namespace tessera {

namespace {

/// More is known than before: a tenth, and at least a little.
bool has_grown(std::uint64_t segments, std::uint64_t before) noexcept {
  constexpr std::uint64_t kLittle = 16;
  return segments >= before + before / 10 + kLittle;
}

bool may_be_compared(const Replicas::Contribution& one, std::uint32_t robot,
                     std::uint32_t epoch) noexcept {
  return one.id.robot == robot && one.id.epoch == epoch && !one.leaving && is_map(one.id) &&
         one.blocks >= LinkMaker::kLeastBlocks;
}

}  // namespace

LinkMaker::Chosen LinkMaker::chosen(const Replicas& replicas, Replicas::Slot slot) noexcept {
  const Replicas::Contribution& one = replicas.contribution(slot);
  return {slot, one.id, one.segments};
}

LinkMaker::Maps LinkMaker::maps_of(const Replicas& replicas, std::uint32_t robot,
                                   std::uint32_t epoch) noexcept {
  Maps maps;
  for (const Replicas::Slot slot : replicas.in_order()) {
    const Replicas::Contribution& one = replicas.contribution(slot);
    if (!may_be_compared(one, robot, epoch)) continue;
    ++maps.count;
    maps.segments += one.segments;
  }
  return maps;
}

LinkMaker::Chosen LinkMaker::newest(const Replicas& replicas, std::uint32_t robot,
                                    std::uint32_t epoch, std::uint32_t number) noexcept {
  const std::span<const Replicas::Slot> slots = replicas.in_order();
  for (std::size_t i = slots.size(); i-- != 0;)
    if (may_be_compared(replicas.contribution(slots[i]), robot, epoch) && number-- == 0)
      return chosen(replicas, slots[i]);
  TESSERA_ASSERT(false);
  return {};
}

std::optional<LinkMaker::Comparison> LinkMaker::due(PairState& pair, const Replicas& replicas,
                                                    std::uint32_t own_robot, Instant now) noexcept {
  if (now < pair.due || (pair.waits && !pair.no_room)) return std::nullopt;
  if (pair.stated) {
    const Result<Replicas::Slot> own = replicas.find(pair.own_id);
    const Result<Replicas::Slot> other = replicas.find(pair.other_id);
    if (own.ok() && other.ok() && !replicas.contribution(*own).leaving &&
        !replicas.contribution(*other).leaving) {
      const Comparison same{chosen(replicas, *own), chosen(replicas, *other)};
      if (!pair.in_doubt && !has_grown(same.segments(), pair.compared)) return std::nullopt;
      return same;
    }
  }
  const Maps own = maps_of(replicas, own_robot, pair.own_epoch);
  const Maps other = maps_of(replicas, pair.robot, pair.epoch);
  const std::uint32_t combinations = own.count * other.count;
  if (combinations != pair.combinations ||
      has_grown(own.segments + other.segments, pair.compared)) {
    pair.combinations = combinations;
    pair.compared = own.segments + other.segments;
    pair.turn = 0;
    pair.is_wide = false;
  }
  if (pair.turn >= combinations) return std::nullopt;
  return Comparison{newest(replicas, own_robot, pair.own_epoch, pair.turn / other.count),
                    newest(replicas, pair.robot, pair.epoch, pair.turn % other.count)};
}

FrameQuestion LinkMaker::question(const PairState& pair,
                                  const TeamPlacement& placement) const noexcept {
  // Between the worlds, where one knows; then between what is compared.
  const auto between_maps = [&](const Matrix34d& T_world_a_world_b) {
    return product(product(inverse(T_world_a_), T_world_a_world_b), T_world_b_);
  };
  if (pair.stated) {
    const Matrix34d T_a_b = between_maps(pair.link.T_from_to);
    return refines_ ? refinement_of(T_a_b) : question_near(T_a_b, kNearGiven);
  }
  // The next time anywhere: what others say, or the frames given, may be wrong.
  const bool is_near = !pair.is_wide;
  const Matrix34d* const T_team_b = placement.placed(pair.robot);
  if (is_near && T_team_b != nullptr && placement.is_sure(pair.robot))
    return question_near(between_maps(between_frames(placement.own(), *T_team_b)), kNearGuess);
  if (is_near && config_.mode == FrameMode::kRefined &&
      placement.prior_kind(pair.robot) != PriorKind::kUnknown)
    return question_near(between_maps(Matrix34d::Identity()), kNearGuess);
  FrameQuestion anywhere;
  anywhere.T_a_b_guess = between_maps(Matrix34d::Identity());
  return anywhere;
}

bool LinkMaker::is_refined(const PairState& pair) const noexcept {
  // A refinement looks where the link is: what a search refuses, no refinement confirms.
  return pair.stated && !pair.in_doubt && pair.refusals == 0 &&
         pair.search.refinements < kMostRefinements &&
         pair.compared < kSearchGrowth * pair.search.compared && pair.search.own_id == own_.id &&
         pair.search.other_id == other_.id;
}

}  // namespace tessera
