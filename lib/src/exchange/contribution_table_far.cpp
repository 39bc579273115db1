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

bool ContributionTable::put_far(HeldContribution& contribution, ExchangeReport& counted) noexcept {
  const BlockExtent extent = extent_of(contribution);
  // Of one that this process has moved nobody else has signed the frame.
  if (contribution.own || contribution.moved || !contribution.open || !contribution.stated ||
      !extent.any() || contribution.frame_doubted || !has_blocks(contribution.id))
    return false;
  // What earlier starts of this robot have published only this one moves and answers for.
  if (publishing() != nullptr && publishing()->id.robot == contribution.id.robot) return false;
  if (!far_.has_room() && !far_.places().empty()) {
    far_.remove(*one_of_most(far_));
    ++counted.forgotten_far;
  }
  FarContribution* const one = far_.add(contribution.id);
  if (one == nullptr) return false;
  one->known() = contribution.known();
  one->extent = extent;
  one->box = world_box(extent, contribution.T_global_map, resolution_m_);
  // Of what was not held, as much as a record takes where they are small.
  constexpr std::uint32_t kSegmentsOfRecord = 4;
  const Replicas::Contribution& held = store_.replicas->contribution(contribution.slot);
  const std::uint32_t lacking =
      contribution.statement.records - std::min(contribution.statement.records, held.blocks);
  one->segments = held.segments + kSegmentsOfRecord * lacking;
  drop(contribution);
  return true;
}

bool ContributionTable::has_place_for(const FarContribution& one) const noexcept {
  return of_robots_.count(one.id()) < most_of_robot(one.id());
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
  place->known() = one.known();
  place->stated = true;
  place->latest = one.statement.latest;
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
