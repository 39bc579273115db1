// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/cast_ray.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "tessera/grid/internal/segment.hpp"

namespace tessera {

namespace {

/// From a voxel's row order in its layer to its bit in LabelPage::observed: octet * 8 + voxel.
constexpr auto kLabelBits = [] {
  std::array<std::uint8_t, kLayerVoxels> bits{};
  for (int octet = 0; octet < kLayerOctets; ++octet) {
    for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
      const auto row = static_cast<std::size_t>(row_order(octet, voxel));
      bits[row] = static_cast<std::uint8_t>(octet * kOctetVoxels + voxel);
    }
  }
  return bits;
}();

/// A walk that asks the map box by box: a box is a block, or a layer of one where the layer's
/// voxels have to be looked at. Within a box a step is an addition and a count, and the voxel's
/// place in its pages goes along.
class RayWalk {
 public:
  RayWalk(const LocalMap& map, const SegmentSteps& steps, bool stop_at_unknown) noexcept
      : map_(map), steps_(steps), stop_at_unknown_(stop_at_unknown) {}

  struct Stop {
    VoxelCoord voxel;
    double t = 0.0;  ///< Part of the segment before the voxel.
    Estimate estimate;
  };
  /// The first voxel that ends the ray, if any does.
  [[nodiscard]] std::optional<Stop> run() noexcept {
    do {
      const Block* const block = find_block();
      bool stopped = false;
      if (block == nullptr) {
        stopped = cross<kBlockEdge>([&](int) { return stop_at_unknown_; });
      } else if (stop_at_unknown_ || !map_.only_labels_occupy()) {
        stopped = cross<kBlockEdge>([&](int row) { return stops_at(*block, voxel_of(row)); });
      } else {
        stopped = cross_labels(*block);
      }
      if (stopped) return Stop{voxel_of(row_), t_, map_.query(voxel_of(row_))};
    } while (!ended_);
    return std::nullopt;
  }

 private:
  [[nodiscard]] VoxelCoord cell() const noexcept {
    return {steps_.cell[0], steps_.cell[1], steps_.cell[2]};
  }
  [[nodiscard]] const Block* find_block() noexcept {
    const BlockCoord at = block_of(cell());
    if (!known_ || !(at == block_coord_)) {
      block_ = map_.find(at);
      block_coord_ = at;
      known_ = true;
    }
    return block_;
  }
  /// The voxel of the box at hand with this place in its row order.
  [[nodiscard]] VoxelCoord voxel_of(int row) const noexcept {
    return {corner_.x + (row & 7), corner_.y + ((row >> 3) & 7), corner_.z + (row >> 6)};
  }
  [[nodiscard]] bool stops_at(const Block& block, VoxelCoord voxel) const noexcept {
    const VoxelState state = map_.state(block, voxel);
    return state == VoxelState::kOccupied || (state == VoxelState::kUnknown && stop_at_unknown_);
  }
  [[nodiscard]] bool cross_labels(const Block& block) noexcept {
    if (!block.has_labels()) return cross<kBlockEdge>([](int) { return false; });
    const LabelPage* const page = map_.label_page(block, octet_in_block(cell()));
    if (page == nullptr) return cross<2>([](int) { return false; });
    const std::uint8_t* const observed = page->observed.data();
    return cross<2>([&](int row) {
      const unsigned bit = kLabelBits[static_cast<std::size_t>(row)];
      if (((unsigned{observed[bit / 8]} >> (bit % 8)) & 1U) == 0) return false;
      return stops_at(block, voxel_of(row));
    });
  }

  /// Walks to the end of the box of 8 x 8 x kHeight voxels that the cell is in, or of the ray;
  /// true iff stops(row order) was at row_. The order of steps, and t, are those of walk_segment.
  template <int kHeight, class Stops>
  bool cross(Stops&& stops) noexcept {
    constexpr std::array<std::int32_t, 3> kEdge{kBlockEdge, kBlockEdge, kHeight};
    constexpr std::array<int, 3> kStride{1, kBlockEdge, kBlockEdge * kBlockEdge};
    std::array<std::int32_t, 3> here{};
    std::array<std::int32_t, 3> count{};  // of steps before the box or the axis is at its end
    int row = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      here[a] = steps_.cell[a] & (kEdge[a] - 1);
      const std::int32_t border = steps_.step[a] > 0 ? kEdge[a] - here[a] : here[a] + 1;
      count[a] = std::min(border, steps_.left[a]);
      row += here[a] * kStride[a];
    }
    corner_ = {steps_.cell[0] - here[0], steps_.cell[1] - here[1], steps_.cell[2] - here[2]};
    const int row_x = steps_.step[0] * kStride[0];
    const int row_y = steps_.step[1] * kStride[1];
    const int row_z = steps_.step[2] * kStride[2];
    const double step_x = steps_.t_step[0];
    const double step_y = steps_.t_step[1];
    const double step_z = steps_.t_step[2];
    double next_x = steps_.t_next[0];
    double next_y = steps_.t_next[1];
    double next_z = steps_.t_next[2];
    std::int32_t left_x = count[0];
    std::int32_t left_y = count[1];
    std::int32_t left_z = count[2];
    double t = t_;
    const auto at_stop = [&] {
      row_ = row;
      t_ = t;
      return true;
    };
    if (stops(row)) return at_stop();
    if ((steps_.left[0] | steps_.left[1] | steps_.left[2]) == 0) {
      ended_ = true;
      return false;
    }
    std::size_t out = 0;  // the axis that leaves
    for (;;) {
      if (next_y < next_x ? next_z < next_y : next_z < next_x) {
        t = next_z;
        out = 2;
        if (--left_z == 0) break;
        next_z += step_z;
        row += row_z;
      } else if (next_y < next_x) {
        t = next_y;
        out = 1;
        if (--left_y == 0) break;
        next_y += step_y;
        row += row_y;
      } else {
        t = next_x;
        out = 0;
        if (--left_x == 0) break;
        next_x += step_x;
        row += row_x;
      }
      if (stops(row)) return at_stop();
    }
    t_ = t;
    steps_.t_next = {next_x, next_y, next_z};
    const std::array<std::int32_t, 3> rest{left_x, left_y, left_z};
    for (std::size_t a = 0; a < 3; ++a) {
      steps_.cell[a] += (count[a] - rest[a]) * steps_.step[a];
      steps_.left[a] -= count[a] - rest[a];
    }
    steps_.t_next[out] =
        steps_.left[out] > 0 ? steps_.t_next[out] + steps_.t_step[out] : SegmentSteps::kNever;
    return false;
  }

  const LocalMap& map_;
  SegmentSteps steps_;
  bool stop_at_unknown_;
  bool ended_ = false;
  bool known_ = false;
  BlockCoord block_coord_{};
  const Block* block_ = nullptr;
  VoxelCoord corner_{};  ///< Of the box at hand.
  int row_ = 0;
  double t_ = 0.0;
};

}  // namespace

RayHit cast_ray(const LocalMap& map, const Point3f& origin_map, const Point3f& direction,
                double max_range_m, bool stop_at_unknown) noexcept {
  RayHit result;
  const Point3d d = direction.cast<double>();
  const double length = norm(d);
  if (!(length > 0.0) || !(length < 1e30) || !(max_range_m > 0.0)) return result;
  const Point3d from = origin_map.cast<double>();
  const Point3d to = from + d * (max_range_m / length);
  const Lattice lattice = map.lattice();
  if (!lattice.voxel_of(origin_map).ok() || !lattice.voxel_of(round_to_float(to)).ok())
    return result;
  const SegmentSteps steps(from / lattice.resolution_m(), to / lattice.resolution_m());
  const std::optional<RayWalk::Stop> stop = RayWalk(map, steps, stop_at_unknown).run();
  if (!stop.has_value()) {
    result.end = RayHit::End::kMaxRange;
    result.distance_m = max_range_m;
    return result;
  }
  const bool unknown = stop->estimate.state == VoxelState::kUnknown;
  return {.end = unknown ? RayHit::End::kUnknown : RayHit::End::kOccupied,
          .voxel = stop->voxel,
          .distance_m = stop->t * max_range_m,
          .estimate = stop->estimate};
}

}  // namespace tessera
