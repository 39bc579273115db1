// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/asked_places.hpp"

#include <algorithm>

namespace tessera {

void AskedPlaces::note(const MapQuery& query, std::int64_t now_us) noexcept {
  const Point3d first = widen(query.points[0]);
  const Point3d second = widen(query.points[1]);
  switch (static_cast<QueryKind>(query.kind)) {
    case QueryKind::kPoints:
    case QueryKind::kNearest:
      note_place(first, now_us);
      break;
    case QueryKind::kRegion:
      note_place((first + second) / 2.0, now_us);
      break;
    case QueryKind::kRay:
      note_place(first, now_us);
      note_place(first + query.length_m * second.normalized(), now_us);
      break;
  }
}

void AskedPlaces::note_place(const Point3d& place, std::int64_t now_us) noexcept {
  if (!place.allFinite()) return;
  static_cast<void>(forget_old(now_us));
  std::uint32_t at = 0;
  while (at < count && norm(points()[at] - place) > kSame_m) ++at;
  if (at == count && count < p_global.size()) ++count;
  if (at == p_global.size())
    at = static_cast<std::uint32_t>(std::min_element(asked_us.begin(), asked_us.end()) -
                                    asked_us.begin());
  p_global[at] = {place.x(), place.y(), place.z()};
  asked_us[at] = now_us;
}

bool AskedPlaces::forget_old(std::int64_t now_us) noexcept {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (now_us - asked_us[i] > kKept_us) continue;
    p_global[kept] = p_global[i];
    asked_us[kept++] = asked_us[i];
  }
  const bool any = kept != count;
  count = kept;
  return any;
}

std::array<Point3d, Sharer::kMostRoute> AskedPlaces::points() const noexcept {
  std::array<Point3d, Sharer::kMostRoute> all;
  all.fill(Point3d::Zero());
  for (std::uint32_t i = 0; i < count; ++i)
    all[i] = Point3d(p_global[i][0], p_global[i][1], p_global[i][2]);
  return all;
}

}  // namespace tessera
