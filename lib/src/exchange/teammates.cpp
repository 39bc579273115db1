// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/teammates.hpp"

#include <algorithm>

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// Two places tell a velocity if they are so far apart in time.
constexpr std::int64_t kLeastStep_ms = 50;
constexpr std::int64_t kMostStep_ms = 1'500;
/// What of a robot's way its velocity may miss: it brakes and turns.
constexpr double kShareOfWay = 0.5;

Point3d velocity_of(const Teammate& before, const Presence& presence) noexcept {
  const std::int64_t step_ms = presence.stamp_ms - before.presence.stamp_ms;
  if (presence.speed_m_per_s == 0) return Point3d::Zero();
  if (step_ms < kLeastStep_ms) return before.velocity;
  if (step_ms > kMostStep_ms) return Point3d::Zero();
  const Point3d way = presence.T_global_body.col(3) - before.presence.T_global_body.col(3);
  const double length_m = norm(way);
  const double seconds = 1e-3 * static_cast<double>(step_ms);
  // No faster than it says: a frame that was corrected moves a robot at once.
  const double most_m = static_cast<double>(presence.speed_m_per_s) * seconds;
  return way * ((length_m > most_m ? most_m / length_m : 1.0) / seconds);
}

}  // namespace

TeammatePlace TeammatePlace::at(Instant other) const noexcept {
  constexpr std::int64_t kMost_us = 1'500'000;
  const std::int64_t ahead_us = std::clamp((other - time).us, -kMost_us, kMost_us);
  const double ahead_s = 1e-6 * static_cast<double>(ahead_us);
  TeammatePlace place = *this;
  place.time = other;
  place.T_map_body.col(3) += velocity * ahead_s;
  const double way_m = static_cast<double>(speed_m_per_s) * (ahead_s < 0.0 ? -ahead_s : ahead_s);
  place.margin_m = std::min(margin_m + kShareOfWay * way_m, std::max(margin_m, kMostMargin_m));
  return place;
}

PlacedBox TeammatePlace::placed_box() const noexcept {
  PlacedBox placed{.T_box_map = inverse(T_map_body), .box = box};
  const auto margin = static_cast<float>(margin_m);
  for (std::size_t i = 0; i < 3; ++i) {
    placed.box.low[i] -= margin;
    placed.box.high[i] += margin;
  }
  return placed;
}

Result<Teammates> Teammates::make(Arena& arena, std::uint32_t most) noexcept {
  Teammates made;
  made.all_ = arena.take<Teammate>(most);
  if (made.all_.size() != most) return Status::kResourceExhausted;
  return made;
}

bool Teammates::is_here(const Teammate& one, Instant now) noexcept {
  return now - one.heard <= (one.presence.speed_m_per_s == 0 ? kStandingFresh : kMovingFresh);
}

/// The robot's own, or a new one in its order; null: there is no place for it.
Teammate* Teammates::place_for(std::uint32_t robot, Instant now) noexcept {
  const auto find = [&] {
    return std::lower_bound(all_.begin(), all_.begin() + static_cast<std::ptrdiff_t>(count_), robot,
                            [](const Teammate& one, std::uint32_t r) { return one.robot < r; });
  };
  auto place = find();
  if (place != all_.begin() + static_cast<std::ptrdiff_t>(count_) && place->robot == robot)
    return &*place;
  if (count_ == all_.size()) {
    const auto gone = std::find_if(all_.begin(), all_.end(),
                                   [&](const Teammate& one) { return !is_here(one, now); });
    if (gone == all_.end()) return nullptr;
    forget(gone->robot);
    place = find();
  }
  std::move_backward(place, all_.begin() + static_cast<std::ptrdiff_t>(count_),
                     all_.begin() + static_cast<std::ptrdiff_t>(count_ + 1));
  ++count_;
  *place = {};
  place->robot = robot;
  return &*place;
}

bool Teammates::hear(std::uint32_t robot, std::uint64_t session, const Presence& presence,
                     Instant now) noexcept {
  if (!Presence::is_plausible(presence.box)) return false;
  Teammate* const one = place_for(robot, now);
  if (one == nullptr) return false;
  const bool goes_on = one->heard != Instant::long_ago() && one->session == session;
  if (goes_on && presence.stamp_ms < one->presence.stamp_ms) return false;
  one->velocity = goes_on ? velocity_of(*one, presence) : Point3d(Point3d::Zero());
  one->session = session;
  one->presence = presence;
  one->heard = now;
  return true;
}

void Teammates::forget(std::uint32_t robot) noexcept {
  const auto used = all_.first(count_);
  const auto kept = std::remove_if(used.begin(), used.end(),
                                   [&](const Teammate& one) { return one.robot == robot; });
  count_ = static_cast<std::size_t>(kept - used.begin());
}

std::size_t Teammates::count(Instant now) const noexcept {
  const std::span<const Teammate> known = all();
  return static_cast<std::size_t>(std::count_if(
      known.begin(), known.end(), [&](const Teammate& one) { return is_here(one, now); }));
}

Result<TeammatePlace> Teammates::at(std::size_t index, double margin_m,
                                    Instant now) const noexcept {
  for (const Teammate& one : all()) {
    if (!is_here(one, now) || index-- != 0) continue;
    const Presence& said = one.presence;
    const TeammatePlace then{
        .robot = one.robot,
        .T_map_body = said.T_global_body,
        .velocity = one.velocity,
        .box = said.box,
        .margin_m = margin_m,
        .speed_m_per_s = said.speed_m_per_s,
        .time = one.heard + Duration{-1'000 * std::int64_t{said.age_ms}},
        .until = one.heard + (said.speed_m_per_s == 0 ? kStandingFresh : kMovingFresh)};
    return then.at(now);
  }
  return Status::kOutOfRange;
}

}  // namespace tessera
