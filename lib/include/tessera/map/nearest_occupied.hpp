// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The obstacle that is nearest to a point, in a map that another thread may write to. Blocks are
// looked at in cubic shells around the point's own, and no farther than the nearest obstacle found.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "tessera/grid/lattice.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

/// What is searched for, from where and how far.
struct NearestQuery {
  Point3f p_map = Point3f::Zero();  ///< Metres.
  double radius_m = 0.0;            ///< How far is searched; > 0.
  std::uint64_t classes = 0;        ///< Bit l: voxels of label l count; 0: all that are occupied.
  /// Of work, at most kMostWork: a block that the map does not have, that is farther than what was
  /// found or than the radius, or that is not in the grid, costs 1, another kNearestBlockWork.
  int max_work = 16'384;
  static constexpr int kMostWork = 1 << 30;
};
inline constexpr int kNearestBlockWork = 16;

struct NearestOccupied {
  bool found = false;
  /// All that is nearer than searched_m was looked at: so what was found is the nearest if
  /// distance_m <= searched_m, and if nothing was, nothing is within searched_m.
  bool complete = false;    ///< searched_m reaches what was found, or the radius.
  bool busy = false;        ///< A block was in the middle of a change at every try.
  VoxelCoord voxel{};       ///< Of several that are as near, the first in (z, y, x) order.
  double distance_m = 0.0;  ///< From the point to the nearest point of the voxel; 0: within it.
  double searched_m = 0.0;
  Estimate estimate{};
  int work = 0;
};

namespace detail {

/// Squared distance from p to the box of edge voxels whose lowest corner is at low, in voxels.
inline double squared_distance(const Point3d& p, const VoxelCoord& low, int edge) noexcept {
  const auto outside = [edge](double at, std::int32_t from) {
    const double below = from - at;
    const double above = at - (from + edge);
    const double most = below > above ? below : above;
    return most > 0.0 ? most : 0.0;
  };
  return squared_norm(outside(p.x(), low.x), outside(p.y(), low.y), outside(p.z(), low.z));
}

/// The search for one query; distances in voxels.
template <class Reader>
class NearestSearch {
 public:
  NearestSearch(Reader& reader, const NearestQuery& query, const Lattice& lattice,
                const Reading& reading, std::span<std::byte> workspace) noexcept
      : reader_(reader),
        query_(query),
        reading_(reading),
        workspace_(workspace),
        at_(query.p_map.cast<double>() / lattice.resolution_m()),
        center_(block_of({floor_to_int(at_.x()), floor_to_int(at_.y()), floor_to_int(at_.z())})),
        limit_(query.radius_m / lattice.resolution_m()),
        best_squared_(limit_ * limit_) {}

  [[nodiscard]] NearestOccupied run(double resolution_m) noexcept {
    double searched = 0.0;
    for (std::int32_t shell = 0; !stopped_; ++shell) {
      // All that is nearer than this lies in the shells before.
      searched = reach(shell);
      const double target = found_.found ? std::sqrt(best_squared_) : limit_;
      if (searched > target) break;
      visit_shell(shell);
    }
    const double target = found_.found ? std::sqrt(best_squared_) : limit_;
    found_.complete = !stopped_ && !found_.busy;
    found_.searched_m = (found_.complete ? target : std::min(searched, target)) * resolution_m;
    found_.distance_m = found_.found ? target * resolution_m : 0.0;
    return found_;
  }

 private:
  /// Distance within which everything lies in shells below this one.
  [[nodiscard]] double reach(std::int32_t shell) const noexcept {
    if (shell == 0) return 0.0;
    const auto on_axis = [shell](double at, std::int32_t center) {
      const double low = at - kBlockEdge * static_cast<double>(center - shell + 1);
      const double high = kBlockEdge * static_cast<double>(center + shell) - at;
      return std::min(low, high);
    };
    return std::min(
        {on_axis(at_.x(), center_.x), on_axis(at_.y(), center_.y), on_axis(at_.z(), center_.z)});
  }
  /// Blocks whose farthest coordinate is shell away from the point's own, in (z, y, x) order.
  void visit_shell(std::int32_t shell) noexcept {
    for (std::int32_t z = -shell; z <= shell && !stopped_; ++z) {
      for (std::int32_t y = -shell; y <= shell && !stopped_; ++y) {
        const bool is_face = z == -shell || z == shell || y == -shell || y == shell;
        const std::int32_t step = is_face || shell == 0 ? 1 : 2 * shell;
        for (std::int32_t x = -shell; x <= shell && !stopped_; x += step)
          visit_block({center_.x + x, center_.y + y, center_.z + z});
      }
    }
  }
  void visit_block(BlockCoord block) noexcept {
    if (found_.work >= query_.max_work) {
      stopped_ = true;
      return;
    }
    // Before anything else: shells are mostly blocks that are not looked up.
    ++found_.work;
    if (!in_grid(block)) return;
    const VoxelCoord low{block.x * kBlockEdge, block.y * kBlockEdge, block.z * kBlockEdge};
    if (squared_distance(at_, low, kBlockEdge) > best_squared_) return;
    const Result<BlockSnapshot> content = reader_.snapshot(block, workspace_);
    if (!content.ok() || !content->empty()) found_.work += kNearestBlockWork - 1;
    if (!content.ok()) {
      found_.busy = stopped_ = true;
      return;
    }
    if (content->empty()) return;
    for (int octet = 0; octet < kBlockOctets; ++octet) visit_octet(*content, octet);
  }
  void visit_octet(const BlockSnapshot& content, int octet) noexcept {
    if (squared_distance(at_, voxel_at(content.coord(), octet, 0), 2) > best_squared_) return;
    const unsigned labels = content.observed_labels(octet);
    for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
      const bool labelled = ((labels >> static_cast<unsigned>(voxel)) & 1U) != 0;
      if (!labelled && content.free_passes(octet, voxel) == 0) continue;
      const VoxelCoord at = voxel_at(content.coord(), octet, voxel);
      const double squared = squared_distance(at_, at, 1);
      if (squared > best_squared_) continue;
      if (found_.found && squared == best_squared_ && !precedes(at, found_.voxel)) continue;
      const Estimate estimate = tessera::estimate(content.evidence(octet, voxel), reading_);
      if (estimate.state != VoxelState::kOccupied || !is_wanted(estimate.label)) continue;
      best_squared_ = squared;
      found_.found = true;
      found_.voxel = at;
      found_.estimate = estimate;
    }
  }
  [[nodiscard]] bool is_wanted(int label) const noexcept {
    return query_.classes == 0 ||
           ((query_.classes >> static_cast<unsigned>(label)) & std::uint64_t{1}) != 0;
  }
  static constexpr bool precedes(const VoxelCoord& a, const VoxelCoord& b) noexcept {
    if (a.z != b.z) return a.z < b.z;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  }

  Reader& reader_;
  const NearestQuery& query_;
  const Reading& reading_;
  std::span<std::byte> workspace_;
  Point3d at_;
  BlockCoord center_;
  double limit_;
  double best_squared_;
  bool stopped_ = false;
  NearestOccupied found_{};
};

}  // namespace detail

/// Searches a Reader with Result<BlockSnapshot> snapshot(BlockCoord, workspace): MapReader,
/// GlobalReader. Blocks are of the moments when they were read. workspace: as the reader's
/// snapshot(). Fails with kOutOfRange iff the point is not finite or not in the grid;
/// kInvalidArgument iff the radius is not finite and positive or over 2^20 voxels, max_work is over
/// kMostWork, or the workspace is too short or not aligned. Stops when max_work is used up: under
/// max_work + kNearestBlockWork units, of which one is at most a look-up that finds nothing, and
/// kNearestBlockWork the copy of a block and a look at its 512 voxels. Exact if complete.
template <class Reader>
[[nodiscard]] Result<NearestOccupied> nearest_occupied(Reader& reader, const Lattice& lattice,
                                                       const Reading& reading,
                                                       const NearestQuery& query,
                                                       std::span<std::byte> workspace) noexcept {
  const double voxels = query.radius_m / lattice.resolution_m();
  if (!(voxels > 0.0) || !(voxels <= static_cast<double>(1 << 20)) ||
      query.max_work > NearestQuery::kMostWork)
    return Status::kInvalidArgument;
  if (workspace.size() < reader.snapshot_bytes() ||
      reinterpret_cast<std::uintptr_t>(workspace.data()) % alignof(std::uint64_t) != 0)
    return Status::kInvalidArgument;
  if (!lattice.voxel_of(query.p_map).ok()) return Status::kOutOfRange;
  detail::NearestSearch<Reader> search(reader, query, lattice, reading, workspace);
  return search.run(lattice.resolution_m());
}

}  // namespace tessera
