// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/teammate_filter.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

bool is_of_use(const PlacedBox& one, const Point3d& origin_map) noexcept {
  RobotBody body;
  body.boxes[body.count++] = one.box;
  return body.is_valid() && check_rigid(one.T_box_map) == Status::kOk &&
         !one.box.holds(apply(one.T_box_map, origin_map));
}

}  // namespace

TeammateFilter::TeammateFilter(std::span<const PlacedBox> boxes, const Point3d& origin_map) noexcept
    : boxes_(boxes.first(std::min(boxes.size(), kMost))), origin_map_(origin_map) {
  if (!(origin_map.cwiseAbs().maxCoeff() <= kFarthest_m)) return;
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    if (!is_of_use(boxes_[i], origin_map)) continue;
    used_ |= std::uint64_t{1} << i;
    mark(i);
  }
}

template <class Visit>
void TeammateFilter::for_used(Visit&& visit) const noexcept {
  for (std::uint64_t rest = used_; rest != 0; rest &= rest - 1)
    visit(boxes_[static_cast<std::size_t>(std::countr_zero(rest))]);
}

/// All cells that its corners are between, and one more for what is rounded.
void TeammateFilter::mark(std::size_t number) noexcept {
  const PlacedBox& one = boxes_[number];
  const Matrix34d T_map_box = inverse(one.T_box_map);
  const Point3d some = apply(T_map_box, Point3d::Zero());
  std::array<double, 2> low{some.x(), some.y()};
  std::array<double, 2> high = low;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto at = [&](std::size_t i) {
      return static_cast<double>((corner >> i & 1U) != 0 ? one.box.high[i] : one.box.low[i]);
    };
    const Point3d p = apply(T_map_box, {at(0), at(1), at(2)});
    for (std::size_t i = 0; i < 2; ++i) {
      const double value = p[static_cast<Eigen::Index>(i)];
      low[i] = corner == 0 ? value : std::min(low[i], value);
      high[i] = corner == 0 ? value : std::max(high[i], value);
    }
  }
  // A little more, so that no rounding loses a return on a face.
  const auto outwards = [](double at, double by) { return static_cast<float>(at + by); };
  const double slack_x = 1e-3 + 1e-6 * std::max(std::abs(low[0]), std::abs(high[0]));
  const double slack_y = 1e-3 + 1e-6 * std::max(std::abs(low[1]), std::abs(high[1]));
  areas_[number] = {outwards(low[0], -slack_x), outwards(high[0], slack_x),
                    outwards(low[1], -slack_y), outwards(high[1], slack_y)};
  std::uint64_t columns = 0;
  const auto visit = [&](std::size_t axis, auto&& use) {
    const double first = std::floor(low[axis] / kCell_m) - 1.0;
    const auto cells =
        static_cast<std::size_t>(std::min((high[axis] - low[axis]) / kCell_m + 4.0, 64.0));
    for (std::size_t i = 0; i < cells; ++i)
      use((static_cast<std::size_t>(static_cast<std::int64_t>(first)) + i) % kCells);
  };
  visit(0, [&](std::size_t cell) { columns |= std::uint64_t{1} << cell; });
  visit(1, [&](std::size_t cell) { cells_[cell] |= columns; });
}

std::uint32_t TeammateFilter::count() const noexcept {
  return static_cast<std::uint32_t>(std::popcount(used_));
}

std::optional<double> TeammateFilter::share_in_boxes(const Point3f& p_map) const noexcept {
  const Point3d p = p_map.cast<double>();
  std::optional<double> share;
  for (std::uint64_t rest = used_; rest != 0; rest &= rest - 1) {
    const auto number = static_cast<std::size_t>(std::countr_zero(rest));
    const Area& area = areas_[number];
    if (p_map.x() < area.low_x || p_map.x() > area.high_x || p_map.y() < area.low_y ||
        p_map.y() > area.high_y)
      continue;
    const PlacedBox& one = boxes_[number];
    const Point3d p_box = apply(one.T_box_map, p);
    if (!one.box.holds(p_box)) continue;
    const Point3d from_box = apply(one.T_box_map, origin_map_);
    share = std::min(share.value_or(1.0), one.box.met_after(from_box, p_box - from_box));
  }
  return share;
}

double TeammateFilter::share_clear(const Point3d& p_map) const noexcept {
  double share = 1.0;
  for_used([&](const PlacedBox& one) {
    const Point3d from_box = apply(one.T_box_map, origin_map_);
    share = std::min(share, one.box.met_after(from_box, apply(one.T_box_map, p_map) - from_box));
  });
  return share;
}

}  // namespace tessera
