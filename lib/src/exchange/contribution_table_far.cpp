// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Contributions that lose their places to nearer ones, and get them again.
#include <algorithm>

#include "tessera/exchange/internal/contribution_table.hpp"

namespace tessera {

namespace {

/// Of the robot that has most of the far places, which are all taken, one. Who opens many
/// contributions crowds out no others.
FarContribution* one_of_most(FarContributions& far) noexcept {
  struct Count {
    std::uint32_t robot = 0;
    std::uint32_t count = 0;
    FarContribution* last = nullptr;
  };
  std::array<Count, Replicas::kMostRobots> counts{};
  for (FarContribution& one : far.places()) {
    if (!one.used) continue;
    for (Count& of : counts) {
      if (of.count != 0 && of.robot != one.id().robot) continue;
      of = {one.id().robot, of.count + 1, &one};
      break;
    }
  }
  return std::max_element(counts.begin(), counts.end(),
                          [](const Count& a, const Count& b) { return a.count < b.count; })
      ->last;
}

}  // namespace

BlockExtent ContributionTable::extent_of(const HeldContribution& contribution) const noexcept {
  BlockExtent extent = contribution.signed_extent;
  if (contribution.open) extent.include(store_.replicas->contribution(contribution.slot).extent);
  return extent;
}

bool ContributionTable::put_far(HeldContribution& contribution, Instant now) noexcept {
  const BlockExtent extent = extent_of(contribution);
  if (contribution.own || !contribution.open || !contribution.stated || !extent.any() ||
      contribution.frame_doubted)
    return false;
  // What earlier starts of this robot have published only this one moves and answers for.
  if (publishing() != nullptr && publishing()->id.robot == contribution.id.robot) return false;
  if (!far_.has_room() && !far_.places().empty()) far_.remove(*one_of_most(far_));
  FarContribution* const one = far_.add(contribution.id);
  if (one == nullptr) return false;
  one->statement = contribution.statement;
  one->proof = contribution.proof;
  one->proof_bytes = contribution.proof_bytes;
  one->frame_revision = contribution.frame_revision;
  one->T_global_map = contribution.T_global_map;
  one->session = contribution.session;
  one->frame_signature = contribution.frame_signature;
  one->extent = extent;
  one->signed_extent = contribution.signed_extent;
  one->box = world_box(extent, contribution.T_global_map, resolution_m_);
  // Of what was not held, as much as a record takes where they are small.
  constexpr std::uint32_t kSegmentsOfRecord = 4;
  const Replicas::Contribution& held = store_.replicas->contribution(contribution.slot);
  const std::uint32_t lacking =
      contribution.statement.records - std::min(contribution.statement.records, held.blocks);
  one->segments = held.segments + kSegmentsOfRecord * lacking;
  one->frame_at = contribution.frame_at;
  one->origin_at = contribution.origin_at;
  one->listed = contribution.listed;
  one->denied = contribution.denied;
  one->since = now;
  drop(contribution);
  return true;
}

bool ContributionTable::has_place_for(const FarContribution& one) const noexcept {
  const bool is_session = MapSession::is(one.id().submap);
  const std::span<const HeldContribution> all = places();
  const auto held = std::count_if(all.begin(), all.end(), [&](const HeldContribution& other) {
    return other.used && !other.own && other.id.robot == one.id().robot &&
           MapSession::is(other.id.submap) == is_session;
  });
  return static_cast<std::uint32_t>(held) < (is_session ? MapSession::kPlacesOfRobot : per_robot_);
}

HeldContribution* ContributionTable::recall(FarContribution& one, Instant now) noexcept {
  HeldContribution* const place = has_place_for(one) ? free_place(false) : nullptr;
  if (place == nullptr) return nullptr;
  drop(*place);
  take_place(*place, one.id(), now);
  if (set_frame(*place, one.T_global_map, one.frame_revision, one.session) != Status::kOk) {
    drop(*place);
    return nullptr;
  }
  place->stated = true;
  place->statement = one.statement;
  place->latest = one.statement.latest;
  place->proof = one.proof;
  place->proof_bytes = one.proof_bytes;
  place->frame_signature = one.frame_signature;
  place->signed_extent = one.signed_extent;
  place->frame_at = one.frame_at;
  place->origin_at = one.origin_at;
  place->listed = one.listed;
  place->denied = one.denied;
  far_.remove(one);
  return place;
}

std::uint32_t ContributionTable::free_places() const noexcept {
  const auto free = static_cast<std::uint32_t>(places_.size() - used_);
  const std::uint32_t kept = own_places_ - std::min(opened_, own_places_);
  return free - std::min(free, kept);
}

bool ContributionTable::is_removing() const noexcept {
  const std::span<const HeldContribution> all = places();
  const auto open = static_cast<std::size_t>(std::count_if(
      all.begin(), all.end(), [](const HeldContribution& one) { return one.used && one.open; }));
  return store_.replicas->in_order().size() > open;
}

}  // namespace tessera
