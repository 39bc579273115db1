// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/thinning.hpp"

#include <array>
#include <bit>

#include "tessera/grid/lattice.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

namespace {

/// The one point that stands for the cell's points, members[i].index in points.
ScanPoint merge_cell(std::span<const ScanPoint> points, std::span<const KeyedIndex> members,
                     int unlabelled, ThinningWeight rule) noexcept {
  if (members.size() == 1) return points[members[0].index];
  Point3d sum = Point3d::Zero();
  std::array<double, kMaxComponents> weight{};
  std::array<std::uint32_t, kMaxComponents> count{};
  std::uint64_t seen = 0;
  for (const KeyedIndex& member : members) {
    const ScanPoint& point = points[member.index];
    sum += point.p_map.cast<double>();
    weight[point.component] += static_cast<double>(point.weight);
    ++count[point.component];
    seen |= std::uint64_t{1} << point.component;
  }
  const std::uint64_t unlabelled_bit = std::uint64_t{1} << static_cast<unsigned>(unlabelled);
  // A label of no weight says nothing, and must not take the place of a return that was there.
  std::uint64_t candidates = 0;
  for (std::uint64_t rest = seen & ~unlabelled_bit; rest != 0; rest &= rest - 1) {
    if (weight[static_cast<std::size_t>(std::countr_zero(rest))] > 0.0) candidates |= rest & -rest;
  }
  if (candidates == 0) candidates = (seen & unlabelled_bit) != 0 ? unlabelled_bit : seen;
  auto winner = static_cast<std::size_t>(std::countr_zero(candidates));
  for (std::uint64_t rest = candidates; rest != 0; rest &= rest - 1) {
    const auto component = static_cast<std::size_t>(std::countr_zero(rest));
    if (weight[component] > weight[winner]) winner = component;
  }
  const auto n = static_cast<double>(members.size());
  const double share =
      rule == ThinningWeight::kSum ? 1.0 : 1.0 / static_cast<double>(count[winner]);
  return {.p_map = (sum / n).cast<float>(),
          .weight = static_cast<float>(weight[winner] * share),
          .component = static_cast<std::uint8_t>(winner)};
}

}  // namespace

std::size_t thin(std::span<const ScanPoint> points, double cell_m, int unlabelled,
                 std::span<ScanPoint> out, std::span<KeyedIndex> sort,
                 ThinningWeight weight) noexcept {
  TESSERA_ASSERT(out.size() >= points.size() && sort.size() >= 2 * points.size());
  const std::span<KeyedIndex> items = sort.first(points.size());
  const Lattice cells(cell_m);
  const auto cell_of = [&](const ScanPoint& point) {
    const Point3d q = cells.to_voxels(point.p_map);
    return std::array<std::int64_t, 3>{floor_to_int64(q.x()), floor_to_int64(q.y()),
                                       floor_to_int64(q.z())};
  };
  if (points.empty()) return 0;
  std::array<std::int64_t, 3> low = cell_of(points[0]);
  std::array<std::int64_t, 3> high = low;
  for (const ScanPoint& point : points) {
    const std::array<std::int64_t, 3> cell = cell_of(point);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (cell[axis] < low[axis]) low[axis] = cell[axis];
      if (cell[axis] > high[axis]) high[axis] = cell[axis];
    }
  }
  // Keys relative to the scan's corner: few bits differ, so the sort takes few passes.
  const auto bits = [&](std::size_t axis) {
    return static_cast<unsigned>(
        std::bit_width(static_cast<std::uint64_t>(high[axis] - low[axis])));
  };
  const unsigned y_shift = bits(0);
  const unsigned z_shift = bits(0) + bits(1);
  TESSERA_ASSERT(z_shift + bits(2) <= 64);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::array<std::int64_t, 3> cell = cell_of(points[i]);
    const auto relative = [&](std::size_t axis) {
      return static_cast<std::uint64_t>(cell[axis] - low[axis]);
    };
    items[i] = {relative(0) | (relative(1) << y_shift) | (relative(2) << z_shift),
                static_cast<std::uint32_t>(i)};
  }
  radix_sort(items, sort.subspan(points.size()));
  std::size_t cells_out = 0;
  for (std::size_t first = 0; first < items.size();) {
    std::size_t end = first + 1;
    while (end < items.size() && items[end].key == items[first].key) ++end;
    out[cells_out++] = merge_cell(points, items.subspan(first, end - first), unlabelled, weight);
    first = end;
  }
  return cells_out;
}

}  // namespace tessera
