// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Who gets a place, and who gives way.
#include <algorithm>

#include "tessera/exchange/internal/contribution_table.hpp"

namespace tessera {

namespace {

/// Without signatures, a robot that was not heard for so long may be one that does not exist.
constexpr Duration kSilentTime{10'000'000};

}  // namespace

/// A place that nobody has, but for those that are kept for this robot's own.
HeldContribution* ContributionTable::free_place(bool own) noexcept {
  const std::uint32_t kept = own ? 0 : own_places_ - std::min(opened_, own_places_);
  if (places_.size() - used_ <= kept) return nullptr;
  std::size_t first = 0;
  while (first < top_ && names_[first].used) ++first;
  return &places_[first];
}

/// The lowest of a robot that is replaced: a newer epoch has the same submap, whole, so it counts
/// nothing where that has evidence. id: whether that one is. O(n log n) in those of the robot.
ContributionTable::Replaced ContributionTable::find_replaced(const ContributionId& id) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < top_; ++i) {
    if (names_[i].used && names_[i].id.robot == id.robot && is_map(names_[i].id))
      of_robot_[count++] = static_cast<std::uint32_t>(i);
  }
  const std::span<std::uint32_t> all = of_robot_.first(count);
  // Newer epochs of a submap first.
  const auto before = [this](std::uint32_t a, std::uint32_t b) {
    const ContributionId& left = names_[a].id;
    const ContributionId& right = names_[b].id;
    return left.submap != right.submap ? left.submap < right.submap : left.epoch > right.epoch;
  };
  std::make_heap(all.begin(), all.end(), before);
  std::sort_heap(all.begin(), all.end(), before);
  Replaced found;
  std::uint32_t submap = 0;
  bool is_whole = false;  // in a newer epoch
  for (const std::uint32_t number : all) {
    HeldContribution& one = places_[number];
    if (number == all.front() || one.id.submap != submap) is_whole = false;
    submap = one.id.submap;
    if (is_whole && one.open && !one.own && (found.lowest == nullptr || one.id < found.lowest->id))
      found.lowest = &one;
    is_whole = is_whole || (one.open && one.complete());
    if (is_whole && submap == id.submap && one.id.epoch > id.epoch) found.is_it = true;
  }
  return found;
}

/// Where a robot has all of its places, the one that gives way: a name, one that is replaced, or
/// the lowest. What is no map has places of its own, and is not replaced. Null where it has fewer;
/// refused where none gives way.
HeldContribution* ContributionTable::displaced_of_robot(const ContributionId& id, bool proven,
                                                        bool& refused) noexcept {
  if (of_robots_.count(id) < most_of_robot(id)) return nullptr;
  HeldContribution* lowest = nullptr;
  for (HeldContribution& other : places()) {
    if (!other.used || other.own || other.id.robot != id.robot || kind_of(other.id) != kind_of(id))
      continue;
    const bool lower =
        lowest == nullptr || (other.open == lowest->open ? other.id < lowest->id : !other.open);
    if (lower) lowest = &other;
  }
  if (lowest == nullptr) return nullptr;
  refused = !proven;
  if (refused) return lowest;
  const Replaced replaced = is_map(id) ? find_replaced(id) : Replaced{};
  const bool is_least = replaced.is_it ? replaced.lowest == nullptr || id < replaced.lowest->id
                                       : replaced.lowest == nullptr && id < lowest->id;
  refused = lowest->open && is_least;
  if (replaced.lowest != nullptr && lowest->open) return replaced.lowest;
  return lowest;
}

bool ContributionTable::has_place_for_frame(const ContributionId& id) noexcept {
  bool refused = false;
  if (displaced_of_robot(id, true, refused) != nullptr) return !refused;
  const std::span<const HeldContribution> all = places();
  return free_place(false) != nullptr ||
         std::any_of(all.begin(), all.end(),
                     [](const HeldContribution& other) { return other.used && !other.open; });
}

bool ContributionTable::would_displace(const ContributionId& id) noexcept {
  bool refused = false;
  return displaced_of_robot(id, true, refused) != nullptr && !refused;
}

/// Where nobody signs, one can fill all places with robots that do not exist: of those that are not
/// heard, the one with the fewest records.
HeldContribution* ContributionTable::place_of_silent(Instant now) noexcept {
  HeldContribution* least = nullptr;
  for (HeldContribution& other : places()) {
    if (!other.used || other.own || now - other.origin_at <= kSilentTime) continue;
    if (least == nullptr || other.records < least->records) least = &other;
  }
  return least;
}

bool ContributionTable::lacks_nothing(const HeldContribution& contribution) const noexcept {
  if (contribution.complete() || has_blocks(contribution.id)) return contribution.complete();
  const auto is_newer = [&](const ContributionId& id) {
    return id.robot == contribution.id.robot && id.epoch > contribution.id.epoch;
  };
  const std::span<const HeldContribution> all = places();
  const std::span<const FarContribution> far = far_.places();
  return std::any_of(all.begin(), all.end(),
                     [&](const HeldContribution& other) {
                       return other.used && other.open && is_newer(other.id);
                     }) ||
         std::any_of(far.begin(), far.end(), [&](const FarContribution& other) {
           return other.used && is_newer(other.id());
         });
}

}  // namespace tessera
