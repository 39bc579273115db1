// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Admission one by one, for a scan that does not fit as a whole. Bounds here are never under those
// of prepare(), and the tiles and ray blocks made here stay: so prepare() finds all that it needs
// for what was admitted, and cannot fail.
#include <bit>

#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

/// The order of non-negative floats as integers.
std::uint64_t ordered_bits(double square) noexcept {
  return std::bit_cast<std::uint32_t>(static_cast<float>(square));
}

std::uint32_t& refusal_counter(ScanReport& report, Integrator::Refusal refusal) noexcept {
  switch (refusal) {
    case Integrator::Refusal::kTiles:
      return report.refused_tiles;
    case Integrator::Refusal::kRayBlocks:
      return report.refused_ray_blocks;
    default:
      return report.refused_storage;
  }
}

/// Moves the points that were not refused to the front, in their order, so that sums run as they
/// would without the refused ones; returns their number.
std::size_t keep_admitted(std::span<ScanPoint> points) noexcept {
  std::size_t kept = 0;
  for (const ScanPoint& point : points) {
    if (point.component != kRefused) points[kept++] = point;
  }
  return kept;
}

}  // namespace

/// Indices of the thinned points, then (from admitted_count_ on) of the far rays, nearest to the
/// sensor first.
std::span<const KeyedIndex> Integrator::order_by_distance() noexcept {
  const std::size_t n = admitted_count_ + ray_count_;
  for (std::size_t i = 0; i < n; ++i) {
    const Point3f& p_map =
        i < admitted_count_ ? admitted_[i].p_map : rays_[i - admitted_count_].p_map;
    sort_[i] = {ordered_bits(squared_norm(p_map.cast<double>() - origin_map_)),
                static_cast<std::uint32_t>(i)};
  }
  radix_sort(sort_.first(n), sort_.subspan(n));
  return sort_.first(n);
}

template <class Visit>
bool Integrator::for_units_reached(const ScanTiles::Place& place, Visit&& visit) const noexcept {
  if (config_.mode == InferenceMode::kMultiEntropy)
    return for_units_across(place.tile, place.unit, visit);
  const int reach = config_.mode == InferenceMode::kKernel ? kernel_reach_units_ : 0;
  return for_units_around(place.tile, place.unit, reach, visit);
}

void Integrator::count_crossed(const LocalMap& map, std::span<const std::uint32_t> crossed,
                               SlabPool::Counts& wanted) noexcept {
  for (const std::uint32_t number : crossed) {
    const RayBlock& ray_block = free_space_.blocks()[number];
    if (!ray_block.reserved) count_ray_block(map, ray_block, wanted);
  }
}

Integrator::Refusal Integrator::try_reserve(LocalMap& map, const ScanPoint& point, bool is_point,
                                            SlabPool::Counts& spoken_for) noexcept {
  const ScanTiles::Place place =
      ScanTiles::place_of(*map.lattice().voxel_of(point.p_map), tiles_.unit_edge());
  SlabPool::Counts wanted = spoken_for;
  const auto count = [&](const BlockCoord& coord, std::uint64_t units) {
    if (!in_grid(coord)) return true;
    const Result<std::uint32_t> number = tiles_.ensure(coord);
    if (!number.ok()) return false;
    const Tile& tile = tiles_.tiles()[*number];
    count_tile(map, tile, units & ~tile.reserved, tile.reserved, wanted);
    return true;
  };
  if (is_point && !for_units_reached(place, count)) return Refusal::kTiles;
  if (!map.fits_or_refuse(wanted)) return Refusal::kStorage;  // before the ray is walked
  std::span<const std::uint32_t> crossed;
  if (config_.free_space.enabled) {
    const Result<std::span<const std::uint32_t>> blocks = free_space_.cross(point.p_map);
    if (!blocks.ok()) return Refusal::kRayBlocks;
    crossed = *blocks;
    count_crossed(map, crossed, wanted);
    if (!map.fits_or_refuse(wanted)) return Refusal::kStorage;
  }
  // A block is opened only where all that goes with it fits. The map's index may still refuse; what
  // was opened until then stays empty and is taken back after the scan.
  const auto open = [&](const BlockCoord& coord, std::uint64_t units) {
    Tile* const tile = tiles_.find(coord);
    return tile == nullptr || open_tile(map, *tile, units);
  };
  if (is_point && !for_units_reached(place, open)) return Refusal::kStorage;
  for (const std::uint32_t number : crossed) {
    if (!map.open_block(free_space_.blocks()[number].coord).ok()) return Refusal::kStorage;
  }
  wanted[kBlockSlab] = 0;  // opened by now
  spoken_for = wanted;
  if (is_point) {
    for_units_reached(place, [&](const BlockCoord& coord, std::uint64_t units) {
      if (Tile* const tile = tiles_.find(coord)) tile->reserved |= units;
      return true;
    });
  }
  for (const std::uint32_t number : crossed) free_space_.blocks()[number].reserved = true;
  return Refusal::kNone;
}

Integrator::Refusal Integrator::reserve(LocalMap& map, const ScanPoint& point, bool is_point,
                                        SlabPool::Counts& spoken_for) noexcept {
  const std::size_t tiles = tiles_.tiles().size();
  const std::size_t ray_blocks = free_space_.blocks().size();
  const Refusal refusal = try_reserve(map, point, is_point, spoken_for);
  if (refusal != Refusal::kNone) {
    tiles_.truncate(tiles);
    free_space_.truncate(ray_blocks);
  }
  return refusal;
}

void Integrator::admit_nearest_first(LocalMap& map, ScanReport& report) noexcept {
  const bool carving = config_.free_space.enabled;
  SlabPool::Counts spoken_for{};
  std::uint64_t work = report.ray_steps;  // on trial
  bool budget_spent = false;
  const std::uint64_t per_point = evaluations_per_point();
  for (const KeyedIndex& item : order_by_distance()) {
    const bool is_point = item.index < admitted_count_;
    ScanPoint& point = is_point ? admitted_[item.index] : rays_[item.index - admitted_count_];
    const std::uint64_t cost =
        (is_point ? per_point : 0) + (carving ? 2 * free_space_.most_steps(point.p_map) : 0);
    budget_spent = budget_spent || (config_.work_budget != 0 && work + cost > config_.work_budget);
    std::uint32_t* counter = is_point ? &report.refused_work : &report.rays_refused_work;
    if (!budget_spent) {
      const std::uint64_t steps_before = free_space_.steps();
      const Refusal refusal = reserve(map, point, is_point, spoken_for);
      const bool fits = refusal == Refusal::kNone;
      work += fits ? cost : free_space_.steps() - steps_before;
      if (fits) continue;
      counter = is_point ? &refusal_counter(report, refusal) : &report.rays_refused_memory;
    }
    ++*counter;
    point.component = kRefused;
  }
  admitted_count_ = keep_admitted(admitted_.first(admitted_count_));
  ray_count_ = keep_admitted(rays_.first(ray_count_));
}

}  // namespace tessera
