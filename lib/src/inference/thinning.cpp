// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/thinning.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "tessera/grid/lattice.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

namespace {

/// The point that stands for a cell, with the labels of one of its points. Rounding is monotone, so
/// a mean lies between the members and is in the grid as they are.
ScanPoint place_mean(const Lattice& lattice, const Point3d& mean, double weight,
                     const ScanPoint& labelled) noexcept {
  const Result<ScanPoint> placed =
      place_point(lattice, round_to_float(mean), static_cast<float>(weight), labelled.component);
  if (!placed.ok()) return labelled;
  ScanPoint point = *placed;
  point.second = labelled.second;
  point.third = labelled.third;
  point.label_weights = labelled.label_weights;
  return point;
}

/// The mean of the members, all of one component.
ScanPoint merge_alike(std::span<const ScanPoint> points, std::span<const KeyedIndex> members,
                      const Lattice& lattice, ThinningWeight rule) noexcept {
  Point3d sum = Point3d::Zero();
  double weight = 0.0;
  for (const KeyedIndex& member : members) {
    const ScanPoint& point = points[member.index];
    sum += point.p_map.cast<double>();
    weight += static_cast<double>(point.weight);
  }
  const auto n = static_cast<double>(members.size());
  const double share = rule == ThinningWeight::kSum ? 1.0 : 1.0 / n;
  return place_mean(lattice, sum / n, weight * share, points[members[0].index]);
}

/// The one point that stands for the cell's points, members[i].index in points.
ScanPoint merge_cell(std::span<const ScanPoint> points, std::span<const KeyedIndex> members,
                     const Lattice& lattice, int unlabelled, ThinningWeight rule) noexcept {
  const ScanPoint& first = points[members[0].index];
  if (members.size() == 1) return first;
  if (std::ranges::all_of(members, [&](const KeyedIndex& member) {
        return points[member.index].component == first.component;
      })) {
    return merge_alike(points, members, lattice, rule);
  }
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
  const auto has_it = [&](const KeyedIndex& member) {
    return points[member.index].component == winner;
  };
  return place_mean(lattice, sum / n, weight[winner] * share,
                    points[std::ranges::find_if(members, has_it)->index]);
}

/// Keys that sort cells by cubes of eight cells a side, in these by cubes of two, each in (z, y, x)
/// order: where a cell is a voxel, that is by tile and unit.
class CellOrder {
 public:
  /// lattice: that the points were registered with.
  CellOrder(std::span<const ScanPoint> points, const Lattice& cells,
            const Lattice& lattice) noexcept
      : cells_(cells), are_voxels_(cells.resolution_m() == lattice.resolution_m()) {
    const auto [low, high] = bounds_of(points);
    // The cell of a coordinate never falls where the coordinate rises.
    const Cell first = cell_of(low);
    const Cell last = cell_of(high);
    // Relative to the scan's corner few bits differ, so the sort takes few passes.
    for (std::size_t axis = 0; axis < 3; ++axis) corner_[axis] = first[axis] & ~std::int64_t{7};
    const auto cubes = [&](std::size_t axis) {
      return static_cast<unsigned>(
          std::bit_width(static_cast<std::uint64_t>(last[axis] - corner_[axis]) >> 3U));
    };
    y_shift_ = kCubeBits + cubes(0);
    z_shift_ = y_shift_ + cubes(1);
    TESSERA_ASSERT(z_shift_ + cubes(2) <= 64);
  }

  [[nodiscard]] std::uint64_t key_of(const ScanPoint& point) const noexcept {
    const VoxelCoord& voxel = point.voxel;
    const Cell cell = are_voxels_ ? Cell{voxel.x, voxel.y, voxel.z} : cell_of(point.p_map);
    const auto x = static_cast<std::uint64_t>(cell[0] - corner_[0]);
    const auto y = static_cast<std::uint64_t>(cell[1] - corner_[1]);
    const auto z = static_cast<std::uint64_t>(cell[2] - corner_[2]);
    const std::uint64_t in_pair = (x & 1U) | ((y & 1U) << 1U) | ((z & 1U) << 2U);
    const std::uint64_t pair = ((x & 6U) << 2U) | ((y & 6U) << 4U) | ((z & 6U) << 6U);
    return in_pair | pair | ((x >> 3U) << kCubeBits) | ((y >> 3U) << y_shift_) |
           ((z >> 3U) << z_shift_);
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  static constexpr unsigned kCubeBits = 9;

  [[nodiscard]] Cell cell_of(const Point3f& p_map) const noexcept {
    const Point3d q = cells_.to_voxels(p_map);
    return {floor_to_int64(q.x()), floor_to_int64(q.y()), floor_to_int64(q.z())};
  }

  Lattice cells_;
  bool are_voxels_;  ///< Cells are the map's voxels, which points know.
  Cell corner_{};
  unsigned y_shift_ = 0;
  unsigned z_shift_ = 0;
};

}  // namespace

std::size_t thin(std::span<const ScanPoint> points, const Lattice& lattice, double cell_m,
                 int unlabelled, std::span<ScanPoint> out, std::span<KeyedIndex> sort,
                 ThinningWeight weight) noexcept {
  TESSERA_ASSERT(out.size() >= points.size() && sort.size() >= 2 * points.size());
  const std::span<KeyedIndex> items = sort.first(points.size());
  if (points.empty()) return 0;
  const CellOrder order(points, Lattice(cell_m), lattice);
  for (std::size_t i = 0; i < points.size(); ++i)
    items[i] = {order.key_of(points[i]), static_cast<std::uint32_t>(i)};
  radix_sort(items, sort.subspan(points.size()));
  constexpr std::size_t kAhead = 8;  // points are not in the order of cells
  std::size_t cells_out = 0;
  for (std::size_t first = 0; first < items.size();) {
    std::size_t end = first + 1;
    while (end < items.size() && items[end].key == items[first].key) ++end;
    if (end + kAhead < items.size()) __builtin_prefetch(&points[items[end + kAhead].index]);
    out[cells_out++] =
        merge_cell(points, items.subspan(first, end - first), lattice, unlabelled, weight);
    first = end;
  }
  return cells_out;
}

}  // namespace tessera
