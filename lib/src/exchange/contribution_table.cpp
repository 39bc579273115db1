// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/contribution_table.hpp"

#include <algorithm>

#include "tessera/base/internal/digest.hpp"

namespace tessera {

namespace {

/// A name for which neither frame nor statement came gives its place back.
constexpr Duration kNameTime{10'000'000};
/// Without signatures, a robot that was not heard for so long may be one that does not exist.
constexpr Duration kSilentTime{10'000'000};
/// An announcement may have been overtaken by what it does not know of yet.
constexpr Duration kDenialTime{500'000};

}  // namespace

Result<ContributionTable> ContributionTable::make(Arena& arena, const ExchangeConfig& config,
                                                  const ReplicaStore& store) noexcept {
  ContributionTable table;
  table.store_ = store;
  table.resolution_m_ = config.resolution_m;
  table.per_robot_ = config.contributions_per_robot;
  table.own_places_ = config.own_contributions;
  table.places_ = arena.take<HeldContribution>(config.contributions);
  if (table.places_.empty()) return Status::kResourceExhausted;
  return table;
}

HeldContribution* ContributionTable::find(const ContributionId& id) noexcept {
  for (HeldContribution& contribution : places_) {
    if (contribution.used && contribution.id == id) return &contribution;
  }
  return nullptr;
}

/// A place that nobody has, but for those that are kept for this robot's own.
HeldContribution* ContributionTable::free_place(bool own) noexcept {
  std::uint32_t kept = own ? 0 : own_places_ - std::min(opened_, own_places_);
  for (HeldContribution& place : places_) {
    if (place.used) continue;
    if (kept == 0) return &place;
    --kept;
  }
  return nullptr;
}

/// Where a robot has all of its places, the one that gives way: a name, or the lowest. Null where
/// it has fewer; refused where none gives way.
HeldContribution* ContributionTable::displaced_of_robot(const ContributionId& id, bool proven,
                                                        bool& refused) noexcept {
  std::uint32_t count = 0;
  HeldContribution* lowest = nullptr;
  for (HeldContribution& other : places_) {
    if (!other.used || other.own || other.id.robot != id.robot) continue;
    ++count;
    const bool lower =
        lowest == nullptr || (other.open == lowest->open ? other.id < lowest->id : !other.open);
    if (lower) lowest = &other;
  }
  if (lowest == nullptr || count < per_robot_) return nullptr;
  refused = !proven || (lowest->open && id < lowest->id);
  return lowest;
}

bool ContributionTable::has_place_for_frame(const ContributionId& id) noexcept {
  bool refused = false;
  if (displaced_of_robot(id, true, refused) != nullptr) return !refused;
  return free_place(false) != nullptr ||
         std::any_of(places_.begin(), places_.end(),
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
  for (HeldContribution& other : places_) {
    if (!other.used || other.own || now - other.origin_at <= kSilentTime) continue;
    if (least == nullptr || other.records < least->records) least = &other;
  }
  return least;
}

HeldContribution* ContributionTable::add(const ContributionId& id, Claim claim, Instant now,
                                         ExchangeReport& counted) noexcept {
  const bool own = claim == Claim::kOwn;
  const bool proven = claim != Claim::kName;
  bool refused = false;
  HeldContribution* const of_robot = own ? nullptr : displaced_of_robot(id, proven, refused);
  if (refused) {
    ++counted.refused_contributions;
    return nullptr;
  }
  HeldContribution* place = of_robot != nullptr ? of_robot : free_place(own);
  if (place == nullptr && proven) {
    // A name gives its place to what is there.
    for (HeldContribution& other : places_) {
      if (other.used && !other.open) place = &other;
    }
  }
  if (place == nullptr && claim == Claim::kPresent) place = place_of_silent(now);
  if (place == nullptr) {
    ++counted.refused_contributions;
    return nullptr;
  }
  if (place->used) ++counted.displaced_contributions;
  drop(*place);
  place->used = true;
  place->id = id;
  place->since = now;
  return place;
}

/// Empties a place. Its index is large: it is cleared where it is.
void ContributionTable::drop(HeldContribution& contribution) noexcept {
  if (contribution.used && contribution.open) store_.remove(store_.context, contribution.slot);
  if (publishing() == &contribution) publishing_ = kNobody;
  contribution.used = contribution.own = contribution.open = false;
  contribution.stated = contribution.full = contribution.frame_doubted = false;
  contribution.proof_bytes = 0;
  ++contribution.generation;
  contribution.latest = contribution.announced_frame = contribution.frame_revision = 0;
  held_bytes_ -= contribution.record_bytes;
  contribution.record_bytes = 0;
  contribution.records = 0;
  contribution.held = {};
  contribution.statement = {};
  contribution.frame_at = contribution.since = contribution.origin_at = Instant::long_ago();
  contribution.listed = contribution.denied = Instant::long_ago();
  contribution.coverage.clear();
  contribution.index.clear();
}

std::uint32_t ContributionTable::drop_unlisted(std::uint32_t robot, std::uint32_t epoch,
                                               Instant now) noexcept {
  return drop_if([&](HeldContribution& contribution) {
    if (contribution.own || contribution.id.robot != robot || contribution.id.epoch < epoch)
      return false;
    if (contribution.listed == now) {
      contribution.denied = Instant::long_ago();
    } else if (contribution.denied == Instant::long_ago()) {
      contribution.denied = now;
    } else {
      return now - contribution.denied >= kDenialTime;
    }
    return false;
  });
}

void ContributionTable::drop_empty_names(Instant now) noexcept {
  drop_if([&](const HeldContribution& contribution) {
    return !contribution.open && !contribution.full && now - contribution.since > kNameTime;
  });
}

bool ContributionTable::has_any_of(std::uint32_t robot) const noexcept {
  return std::any_of(places_.begin(), places_.end(), [&](const HeldContribution& contribution) {
    return contribution.used && contribution.id.robot == robot;
  });
}

Status ContributionTable::set_frame(HeldContribution& contribution, const Matrix34d& T_global_map,
                                    std::uint32_t revision) const noexcept {
  const Result<GridTransform> frame = GridTransform::make(T_global_map, resolution_m_);
  if (!frame.ok()) return Status::kInvalidArgument;
  if (!contribution.open) {
    const Result<Replicas::Slot> slot = store_.open(store_.context, contribution.id, *frame);
    if (!slot.ok()) return slot.status();
    contribution.slot = *slot;
    contribution.open = true;
  }
  store_.set_frame(store_.context, contribution.slot, *frame, revision);
  contribution.T_global_map = T_global_map;
  contribution.frame_revision = revision;
  contribution.frame_doubted = false;
  contribution.announced_frame = std::max(contribution.announced_frame, revision);
  return Status::kOk;
}

std::uint64_t ContributionTable::digest() const noexcept {
  // A sum: contributions came in any order.
  std::uint64_t sum = 0;
  for (const HeldContribution& contribution : places_) {
    if (!contribution.used || !contribution.open) continue;
    Digest of;
    of.add(contribution.id.robot);
    of.add(std::uint64_t{contribution.id.epoch} << 32U | contribution.id.submap);
    of.add(contribution.frame_revision);
    for (const double element : contribution.T_global_map.reshaped())
      of.add(std::bit_cast<std::uint64_t>(element));
    of.add(contribution.held.low);
    of.add(contribution.held.high);
    sum += of.value();
  }
  return sum;
}

}  // namespace tessera
