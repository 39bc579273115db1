// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Admission one by one, for a scan that does not fit as a whole. Bounds here are never under those
// of prepare(), and the tiles and ray blocks made here stay: so prepare() finds all that it needs
// for what was admitted, and cannot fail.
#include "tessera/inference/admission_order.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

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

}  // namespace

std::size_t Integrator::keep_admitted(std::span<ScanPoint> points) noexcept {
  std::size_t kept = 0;
  for (const ScanPoint& point : points) {
    if (point.component != kRefused) points[kept++] = point;
  }
  return kept;
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

/// Of the units that a point in reach could bring evidence to, those that may receive some with the
/// points admitted so far, as want_units finds them.
std::uint64_t Integrator::receiving_units(const Tile& tile, std::uint64_t reached) const noexcept {
  if (config_.mode != InferenceMode::kMultiEntropy) return reached;
  std::array<std::uint64_t, 6> faces{};
  for (std::size_t face = 0; face < 6; ++face) {
    const Tile* const beside = tiles_.find(tile.coord + kFaceSteps[face]);
    faces[face] = beside == nullptr ? 0 : beside->occupied;
  }
  const std::uint64_t filled =
      at_least(neighbour_masks(tile.occupied, faces), config_.entropy.fill_neighbours);
  return reached & (tile.occupied | filled);
}

bool Integrator::count_units(const LocalMap& map, const ScanTiles::Place& place,
                             SlabPool::Counts& wanted) noexcept {
  const Result<std::uint32_t> own = tiles_.ensure(place.tile);
  if (!own.ok()) return false;
  tiles_.tiles()[*own].occupied |= unit_bit(place.unit);
  return for_units_reached(place, [&](const BlockCoord& coord, std::uint64_t reached) {
    if (!in_grid(coord)) return true;
    const Result<std::uint32_t> number = tiles_.ensure(coord);
    if (!number.ok()) return false;
    Tile& tile = tiles_.tiles()[*number];
    const std::uint64_t units = receiving_units(tile, reached) & ~tile.reserved;
    count_tile(map, tile, units, tile.reserved, wanted);
    return true;
  });
}

/// The map's index may refuse; what was opened until then stays empty and is taken back after the
/// scan.
bool Integrator::open_units(LocalMap& map, const ScanTiles::Place& place) noexcept {
  return for_units_reached(place, [&](const BlockCoord& coord, std::uint64_t reached) {
    Tile* const tile = tiles_.find(coord);
    return tile == nullptr || open_tile(map, *tile, receiving_units(*tile, reached));
  });
}

/// new_unit: the point's, if no admitted point lies in it yet; other points need no more storage.
Integrator::Refusal Integrator::try_reserve(LocalMap& map, const ScanPoint& point,
                                            const ScanTiles::Place* new_unit,
                                            SlabPool::Counts& spoken_for) noexcept {
  SlabPool::Counts wanted = spoken_for;
  if (new_unit != nullptr && !count_units(map, *new_unit, wanted)) return Refusal::kTiles;
  if (!map.fits_or_refuse(wanted)) return Refusal::kStorage;  // before the ray is walked
  std::span<const std::uint32_t> crossed;
  if (config_.free_space.enabled) {
    const Result<std::span<const std::uint32_t>> blocks = free_space_.cross(point.p_map);
    if (!blocks.ok()) return Refusal::kRayBlocks;
    crossed = *blocks;
    count_crossed(map, crossed, wanted);
    if (!map.fits_or_refuse(wanted)) return Refusal::kStorage;
  }
  // A block is opened only where all that goes with it fits.
  bool opened = new_unit == nullptr || open_units(map, *new_unit);
  for (const std::uint32_t number : crossed) {
    opened = opened && (free_space_.blocks()[number].reserved ||
                        map.open_block(free_space_.blocks()[number].coord).ok());
  }
  if (!opened) {
    open_failed_ = true;
    return Refusal::kStorage;
  }
  wanted[kBlockSlab] = 0;  // opened by now
  spoken_for = wanted;
  if (new_unit != nullptr) {
    for_units_reached(*new_unit, [&](const BlockCoord& coord, std::uint64_t reached) {
      if (Tile* const tile = tiles_.find(coord)) tile->reserved |= receiving_units(*tile, reached);
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
  const ScanTiles::Place place =
      ScanTiles::place_of(*map.lattice().voxel_of(point.p_map), tiles_.unit_edge());
  const Tile* const before = is_point ? tiles_.find(place.tile) : nullptr;
  const bool new_unit =
      is_point && (before == nullptr || (before->occupied & unit_bit(place.unit)) == 0);
  const Refusal refusal = try_reserve(map, point, new_unit ? &place : nullptr, spoken_for);
  if (refusal != Refusal::kNone) {
    Tile* const tile = new_unit ? tiles_.find(place.tile) : nullptr;
    if (tile != nullptr) tile->occupied &= ~unit_bit(place.unit);
    tiles_.truncate(tiles);
    free_space_.truncate(ray_blocks);
  }
  return refusal;
}

bool Integrator::is_spent(std::uint64_t work, std::uint64_t to_write, std::size_t& asked) noexcept {
  if (work > work_limit_) return true;
  if (asked++ % kPointBatch != 0 || in_time(to_write)) return false;
  limit_is_deadline_ = true;
  return true;
}

void Integrator::admit_one_by_one(LocalMap& map, ScanReport& report) noexcept {
  const bool carving = config_.free_space.enabled;
  SlabPool::Counts spoken_for{};
  std::uint64_t work = report.ray_steps;  // on trial
  std::uint64_t to_write = 0;             // of the work, what comes after admission
  rays_predicted_ = 0;
  bool spent = false;
  std::size_t asked = 0;
  const std::uint64_t per_point = evaluations_per_point();
  // A second point in a unit takes work and no storage, so only where work runs out is it better to
  // have the first of more units.
  const AdmissionScene scene{.points = admitted(),
                             .rays = admitted_rays(),
                             .lattice = map.lattice(),
                             .origin_map = origin_map_,
                             .unit_edge = unit_edge(),
                             .spread = over_limit_};
  for (const KeyedIndex& item : order_of_admission(scene, sort_)) {
    const bool is_point = item.index < admitted_count_;
    ScanPoint& point = is_point ? admitted_[item.index] : rays_[item.index - admitted_count_];
    const std::uint64_t steps = carving ? free_space_.most_steps(point.p_map) : 0;
    const std::uint64_t cost = (is_point ? per_point : 0) + 2 * steps;
    spent = spent || is_spent(work + cost, to_write, asked);
    std::uint32_t* counter = work_counter(report, is_point);
    if (!spent) {
      const std::uint64_t steps_before = free_space_.steps();
      const Refusal refusal = reserve(map, point, is_point, spoken_for);
      if (refusal == Refusal::kNone) {
        work += cost;
        to_write += cost - steps;
        rays_predicted_ += steps;
        continue;
      }
      work += free_space_.steps() - steps_before;
      counter = is_point ? &refusal_counter(report, refusal) : &report.rays_refused_memory;
    }
    ++*counter;
    point.component = kRefused;
  }
  report.work_predicted = report.work_limit == 0 ? 0 : work;
  admitted_count_ = keep_admitted(admitted_.first(admitted_count_));
  ray_count_ = keep_admitted(rays_.first(ray_count_));
}

std::uint32_t* Integrator::work_counter(ScanReport& report, bool is_point) const noexcept {
  if (limit_is_deadline_)
    return is_point ? &report.refused_deadline : &report.rays_refused_deadline;
  return is_point ? &report.refused_work : &report.rays_refused_work;
}

}  // namespace tessera
