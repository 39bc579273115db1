// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where this robot and the others are.
#include "tessera/base/rigid.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera {

void Sharer::note_place(std::uint32_t submap, std::int64_t stamp_us, const Matrix34d& T_map_body,
                        std::int64_t now_us) noexcept {
  if (!tells_place_) return;
  const Matrix34d T_global_map = frames_.has(submap) ? frame_of(submap) : frame_;
  exchange_.note_place(product(T_global_map, T_map_body), stamp_us, now_us);
}

Matrix34d Sharer::map_from_global(std::uint32_t submap) const noexcept {
  return inverse(frames_.has(submap) ? frame_of(submap) : frame_);
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
  if (!has_place_) return;
  const std::optional<ContributionId> own = exchange_.publishing();
  if (own) objections_.tick({maps.of(submap_.submap), *own, frame_, places_.front()});
}

}  // namespace tessera
