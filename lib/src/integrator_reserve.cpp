// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Admission one by one, for a scan that does not fit as a whole. Bounds here are never under those
// of prepare(), which therefore succeeds with what was admitted.
#include <bit>

#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

/// The order of non-negative floats as integers.
std::uint64_t ordered_bits(double square) noexcept {
  return std::bit_cast<std::uint32_t>(static_cast<float>(square));
}

}  // namespace

/// Indices of the thinned points, then (from admitted_count_ on) of the far rays, nearest to the
/// sensor first.
std::span<const KeyedIndex> Integrator::order_by_distance() noexcept {
  const std::size_t n = admitted_count_ + ray_count_;
  for (std::size_t i = 0; i < n; ++i) {
    const Point3f& p_map =
        i < admitted_count_ ? admitted_[i].p_map : rays_[i - admitted_count_].p_map;
    sort_[i] = {ordered_bits((p_map.cast<double>() - origin_map_).squaredNorm()),
                static_cast<std::uint32_t>(i)};
  }
  radix_sort(sort_.first(n), sort_.subspan(n));
  return sort_.first(n);
}

int Integrator::reach_units() const noexcept {
  switch (config_.mode) {
    case InferenceMode::kCounting:
      return 0;
    case InferenceMode::kKernel:
      return kernel_reach_units_;
    case InferenceMode::kMultiEntropy:
      break;
  }
  return 1;
}

bool Integrator::open_reserved(LocalMap& map, const ScanPoint& point, bool is_point) noexcept {
  const ScanTiles::Place place =
      ScanTiles::place_of(*map.lattice().voxel_of(point.p_map), tiles_.unit_edge());
  const bool tiles_open =
      !is_point || for_units_around(place.tile, place.unit, reach_units(),
                                    [&](const BlockCoord& coord, std::uint64_t box) {
                                      Tile* const tile = tiles_.find(coord);
                                      return tile == nullptr || open_tile(map, *tile, box);
                                    });
  if (!tiles_open || !config_.free_space.enabled) return tiles_open;
  return free_space_.for_each_block(point.p_map, [&](RayBlock& ray_block) {
    return map.open_block(ray_block.coord).ok();
  }) == Status::kOk;
}

bool Integrator::reserve(LocalMap& map, const ScanPoint& point, bool is_point,
                         SlabPool::Counts& spoken_for) noexcept {
  const ScanTiles::Place place =
      ScanTiles::place_of(*map.lattice().voxel_of(point.p_map), tiles_.unit_edge());
  const bool carving = config_.free_space.enabled;
  SlabPool::Counts wanted = spoken_for;
  const bool tiles_fit =
      !is_point ||
      for_units_around(place.tile, place.unit, reach_units(),
                       [&](const BlockCoord& coord, std::uint64_t box) {
                         if (!in_grid(coord)) return true;
                         const Result<std::uint32_t> number = tiles_.ensure(coord);
                         if (!number.ok()) return false;
                         const Tile& tile = tiles_.tiles()[*number];
                         count_tile(map, tile, box & ~tile.reserved, tile.reserved, wanted);
                         return true;
                       });
  const bool rays_fit =
      tiles_fit && (!carving || free_space_.for_each_block(point.p_map, [&](RayBlock& ray_block) {
        if (!ray_block.reserved) count_ray_block(map, ray_block, wanted);
        return true;
      }) == Status::kOk);
  // Storage first: a block is opened only where all that goes with it fits. The index may still
  // refuse; what was opened until then stays empty and is taken back after the scan.
  if (!rays_fit || !map.fits(wanted) || !open_reserved(map, point, is_point)) return false;
  wanted[kBlockSlab] = 0;  // opened by now
  spoken_for = wanted;
  if (is_point) {
    for_units_around(place.tile, place.unit, reach_units(),
                     [&](const BlockCoord& coord, std::uint64_t box) {
                       if (Tile* const tile = tiles_.find(coord)) tile->reserved |= box;
                       return true;
                     });
  }
  if (!carving) return true;
  return free_space_.for_each_block(point.p_map, [](RayBlock& ray_block) {
    return ray_block.reserved = true;
  }) == Status::kOk;
}

void Integrator::admit_nearest_first(LocalMap& map, ScanReport& report) noexcept {
  const bool carving = config_.free_space.enabled;
  if (carving) free_space_.begin(config_.free_space, map.lattice(), origin_map_);
  tiles_.reset(unit_edge());
  SlabPool::Counts spoken_for{};
  std::uint64_t work = 0;
  bool budget_spent = false;
  const std::uint64_t per_point = evaluations_per_point();
  for (const KeyedIndex& item : order_by_distance()) {
    const bool is_point = item.index < admitted_count_;
    ScanPoint& point = is_point ? admitted_[item.index] : rays_[item.index - admitted_count_];
    const std::uint64_t cost =
        (is_point ? per_point : 0) + (carving ? free_space_.most_steps(point.p_map) : 0);
    budget_spent = budget_spent || (config_.work_budget != 0 && work + cost > config_.work_budget);
    if (!budget_spent && reserve(map, point, is_point, spoken_for)) {
      work += cost;
      continue;
    }
    if (!is_point) {
      ++report.rays_refused;
    } else {
      ++(budget_spent ? report.refused_work : report.refused_memory);
    }
    point.component = kRefused;
  }
  // Kept in their order, so that sums run as they would without the refused ones.
  const auto keep_admitted = [](std::span<ScanPoint> points) {
    std::size_t kept = 0;
    for (const ScanPoint& point : points) {
      if (point.component != kRefused) points[kept++] = point;
    }
    return kept;
  };
  admitted_count_ = keep_admitted(admitted_.first(admitted_count_));
  ray_count_ = keep_admitted(rays_.first(ray_count_));
}

}  // namespace tessera
