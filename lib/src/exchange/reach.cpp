// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/reach.hpp"

#include <algorithm>
#include <limits>

namespace tessera {

bool Reach::measure(Ledger& ledger, std::uint32_t& starved_robot) const noexcept {
  bool is_starved = false;
  const HeldContribution* const publishing = ledger.publishing();
  for (HeldContribution& one : ledger.places()) {
    if (!one.used || one.own || !one.open) continue;
    // One whose extent is not known yet may be anywhere, and what has no blocks is of any place;
    // what this robot's earlier starts have published it keeps, as it answers for it.
    const BlockExtent extent = ledger.table().extent_of(one);
    const bool is_ours = publishing != nullptr && publishing->id.robot == one.id.robot;
    one.away_m = extent.any() && !is_ours && has_blocks(one.id)
                     ? interest_.distance_m(world_box(extent, one.T_global_map, resolution_m_))
                     : 0.0;
    if (one.away_m > 0.0 || !one.full || is_starved) continue;
    is_starved = true;
    starved_robot = one.id.robot;
  }
  return is_starved;
}

HeldContribution* Reach::next_to_want(Ledger& ledger, const CountByRobot& awaited,
                                      double most_m) noexcept {
  HeldContribution* next = nullptr;
  for (HeldContribution& one : ledger.places()) {
    if (!one.used || one.own || !one.open || !one.far || one.whole || one.away_m > most_m) continue;
    if (next != nullptr && one.away_m >= next->away_m) continue;
    if (awaited[ledger.replicas().contribution(one.slot).robot_bit] < kAtOnce) next = &one;
  }
  return next;
}

void Reach::set_far(Ledger& ledger, Repair& repair, HeldContribution& one, bool far,
                    Instant now) noexcept {
  if (one.far == far) return;
  one.far = far;
  one.full = false;
  one.wanted_at = now;
  repair.note_lack(ledger, one, now);
}

bool Reach::is_waiting(Ledger& ledger, Instant now) noexcept {
  const std::span<const HeldContribution> places = ledger.places();
  return std::any_of(places.begin(), places.end(), [now](const HeldContribution& one) {
    const bool is_near = one.used && !one.own && one.open && one.away_m <= 0.0;
    return is_near && (one.far ? !one.whole : is_awaited(one, now));
  });
}

void Reach::want(Ledger& ledger, Repair& repair, std::uint32_t fullness,
                 Instant now) const noexcept {
  CountByRobot awaited{};
  const bool is_full = fullness >= kSome;
  const bool only_near = is_full || is_waiting(ledger, now);
  for (HeldContribution& one : ledger.places()) {
    if (!one.used || one.own || !one.open) continue;
    const bool is_near = one.away_m <= 0.0;
    if (one.whole) {
      set_far(ledger, repair, one, !is_near && is_full, now);
    } else if (!interest_.any()) {
      set_far(ledger, repair, one, false, now);
    } else if (!is_near && only_near) {
      set_far(ledger, repair, one, true, now);
    }
    if (is_awaited(one, now)) ++awaited[ledger.replicas().contribution(one.slot).robot_bit];
  }
  const double most_m = only_near ? 0.0 : std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < kMostChanges; ++i) {
    HeldContribution* const one = next_to_want(ledger, awaited, most_m);
    if (one == nullptr) return;
    set_far(ledger, repair, *one, false, now);
    ++awaited[ledger.replicas().contribution(one->slot).robot_bit];
  }
}

HeldContribution* Reach::farthest(Ledger& ledger, bool is_needed, const std::uint32_t* robot,
                                  Instant now) noexcept {
  HeldContribution* found = nullptr;
  for (HeldContribution& one : ledger.places()) {
    if (!one.used || one.own || !one.open || !one.stated || one.records == 0) continue;
    if (one.away_m <= 0.0 || (robot != nullptr && one.id.robot != *robot)) continue;
    // The last one who has it keeps it, if nothing nearer needs the room.
    if (now - one.elsewhere > kElsewhereTime && !is_needed) continue;
    if (found == nullptr || one.away_m > found->away_m) found = &one;
  }
  return found;
}

/// What finds no room is asked for ever more seldom, as room seldom comes.
void Reach::ask_again(Ledger& ledger, Repair& repair, Instant now) noexcept {
  if (!has_dropped_ || ledger.table().is_removing()) return;
  has_dropped_ = false;
  for (HeldContribution& one : ledger.places()) {
    if (!one.used || !one.full || one.far) continue;
    repair.note_room(ledger, one, now);
    one.wanted_at = now;
  }
}

void Reach::drop_empty(Ledger& ledger, ExchangeReport& counted) const noexcept {
  std::uint32_t free = ledger.table().free_places();
  std::uint32_t dropped = 0;
  for (HeldContribution& one : ledger.places()) {
    if (free >= spare_places() || dropped == kMostEmpty) return;
    if (!one.used || one.own || !one.open || !one.stated || one.records != 0 || one.away_m <= 0.0)
      continue;
    if (!ledger.table().put_far(one, counted)) {
      ++counted.refused_far;
      return;
    }
    ++counted.made_far;
    ++dropped;
    ++free;
  }
}

void Reach::drop(Ledger& ledger, std::uint32_t fullness, const std::uint32_t* starved, Instant now,
                 ExchangeReport& counted) noexcept {
  drop_empty(ledger, counted);
  // What was dropped gives its room back with the next pieces of fusion.
  if (ledger.table().is_removing()) return;
  // With room left, what finds none has used up its robot's share.
  const std::uint32_t* const robot = fullness < kShort ? starved : nullptr;
  const std::uint64_t used = std::max<std::uint32_t>(ledger.replicas().usage().segments, 1);
  std::uint64_t freed = 0;  // of the segments, and as much of all else
  for (std::uint32_t i = 0; i < kMostChanges; ++i) {
    const bool is_crowded = ledger.table().free_places() < spare_places();
    const bool is_full = fullness >= kShort && fullness - fullness * freed / used >= kSome;
    const bool is_needed = i == 0 && starved != nullptr;
    if (!is_crowded && !is_full && !is_needed) return;
    HeldContribution* const one = farthest(ledger, starved != nullptr, robot, now);
    if (one == nullptr) return;
    freed += ledger.replicas().contribution(one->slot).segments;
    if (!ledger.table().put_far(*one, counted)) {
      ++counted.refused_far;
      return;
    }
    ++counted.made_far;
    has_dropped_ = true;
  }
}

FarContribution* Reach::nearest(Ledger& ledger, std::uint32_t most_segments,
                                double most_m) const noexcept {
  FarContribution* found = nullptr;
  double least_m = std::numeric_limits<double>::infinity();
  for (FarContribution& one : ledger.far().places()) {
    if (!one.used || one.segments > most_segments) continue;
    const double at_m = interest_.distance_m(one.box);
    if (at_m > most_m || at_m >= least_m || !ledger.table().has_place_for(one)) continue;
    least_m = at_m;
    found = &one;
  }
  return found;
}

std::uint64_t Reach::recall(Ledger& ledger, std::uint32_t fullness, Instant now,
                            ExchangeReport& counted) const noexcept {
  constexpr std::uint32_t kAny = ~std::uint32_t{0};
  const std::uint64_t segments = ledger.replicas().config().segments;
  std::uint64_t looked = 0;
  for (std::uint32_t i = 0; i < kMostChanges && ledger.far().size() != 0; ++i) {
    looked += ledger.far().places().size();
    FarContribution* one = nearest(ledger, kAny, 0.0);
    if (one == nullptr && i == 0 && fullness < kPlenty &&
        ledger.table().free_places() > 2 * spare_places()) {
      looked += ledger.far().places().size();
      one = nearest(ledger, static_cast<std::uint32_t>(segments * (kSome - fullness) / 1024),
                    std::numeric_limits<double>::infinity());
    }
    if (one == nullptr || ledger.table().recall(*one, now) == nullptr) break;
    ++counted.made_near;
  }
  return looked;
}

std::uint64_t Reach::tick(Ledger& ledger, Repair& repair, Instant now,
                          ExchangeReport& counted) noexcept {
  if (!is_on_ || now < due_) return 0;
  due_ = now + kTurn;
  const std::uint32_t fullness = ledger.records().fullness();
  const std::uint64_t looked = recall(ledger, fullness, now, counted);
  std::uint32_t starved = 0;
  const bool is_starved = measure(ledger, starved);
  want(ledger, repair, fullness, now);
  ask_again(ledger, repair, now);
  drop(ledger, fullness, is_starved ? &starved : nullptr, now, counted);
  return looked;
}

}  // namespace tessera
