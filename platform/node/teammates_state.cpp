// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/teammates_state.hpp"

#include <algorithm>

#include "tessera/base/rigid.hpp"
#include "vehicle/boxes_in_sectors.hpp"

namespace tessera {

namespace {

/// A scan takes a while, and so does its way here: what one moves in it is added to its margin.
constexpr double kScan_s = 0.05;

}  // namespace

void TeammatesState::take(const Sharer& sharer, std::uint32_t submap,
                          std::int64_t now_us) noexcept {
  const Matrix34d T_map_global = sharer.map_from_global(submap);
  count = 0;
  while (count < kMost) {
    const Result<TeammatePlace> place = sharer.teammate_at(count, now_us);
    if (!place.ok()) break;
    One& one = all[count++];
    one.robot = place->robot;
    one.speed_m_per_s = place->speed_m_per_s;
    const Matrix34d T = product(T_map_global, place->T_map_body);
    std::copy_n(T.data(), one.T_map_body.size(), one.T_map_body.begin());
    const Point3d velocity = T_map_global.leftCols<3>() * place->velocity;
    std::copy_n(velocity.data(), one.velocity.size(), one.velocity.begin());
    one.box = place->box;
    one.margin_m = place->margin_m + kScan_s * place->speed_m_per_s;
    one.time_us = now_us;
    one.until_us = place->until.us();
  }
}

std::size_t TeammatesState::place(std::int64_t time_us,
                                  std::span<PlacedBox, kMost> into) const noexcept {
  std::size_t placed = 0;
  for (const One& one : std::span(all).first(count)) {
    if (time_us > one.until_us) continue;
    TeammatePlace place;
    std::copy(one.T_map_body.begin(), one.T_map_body.end(), place.T_map_body.data());
    std::copy(one.velocity.begin(), one.velocity.end(), place.velocity.data());
    place.box = one.box;
    place.margin_m = one.margin_m;
    place.speed_m_per_s = one.speed_m_per_s;
    place.time = Instant::at_us(one.time_us);
    into[placed++] = place.at(Instant::at_us(time_us)).placed_box();
  }
  return placed;
}

void TeammatesState::add_to(SectorsReport& sectors, const Matrix34d& T_map_body,
                            const ObstacleSectorsConfig& config,
                            std::int64_t time_us) const noexcept {
  std::array<PlacedBox, kMost> boxes;
  const auto used = std::span(sectors.sectors).first(static_cast<std::size_t>(sectors.count));
  for (const PlacedBox& one : std::span(boxes).first(place(time_us, boxes)))
    add_box(one, T_map_body, config, used);
}

}  // namespace tessera
