// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Admission one by one, for a scan that does not fit as a whole. Bounds here are never under what
// the scan takes in the end; the tiles, ray blocks and blocks of the map made here stay. So filling
// the scratch for what was admitted finds all that it needs.
#include "tessera/inference/integrator.hpp"
#include "tessera/inference/internal/admission_order.hpp"

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

/// Of the units of a tile that a point in reach could bring evidence to, those that may receive
/// some with the points admitted so far, as want_units finds them. Tiles that are not linked have
/// no say in each other, as there.
std::uint64_t Integrator::receiving_units(const Tile& tile, std::uint64_t reached) const noexcept {
  if (config_.mode != InferenceMode::kMultiEntropy) return reached;
  std::array<std::uint64_t, 6> faces{};
  for (std::size_t face = 0; face < 6; ++face) {
    const Tile* const beside = tiles_.beside(tile, face);
    faces[face] = beside == nullptr ? 0 : beside->occupied;
  }
  const std::uint64_t filled =
      at_least(neighbour_masks(tile.occupied, faces), config_.entropy.fill_neighbours);
  return reached & (tile.occupied | filled);
}

/// Calls visit(number of a tile, its units that the point may contribute to), making the tiles.
/// False: tiles or their index are full.
template <class Visit>
bool Integrator::for_units_reached(std::uint32_t own, const ScanTiles::Place& place,
                                   Visit&& visit) noexcept {
  const std::uint64_t bit = unit_bit(place.unit);
  if (config_.mode == InferenceMode::kKernel) {
    return for_units_around(place.tile, place.unit, kernel_reach_units_,
                            [&](const BlockCoord& coord, std::uint64_t reached) {
                              if (!in_grid(coord)) return true;
                              const Result<std::uint32_t> number = tiles_.ensure(coord);
                              if (number.ok()) visit(*number, reached);
                              return number.ok();
                            });
  }
  std::uint64_t here = bit;
  if (config_.mode == InferenceMode::kMultiEntropy) {
    const std::array<std::uint64_t, 6> spill = neighbour_masks(0, {bit, bit, bit, bit, bit, bit});
    for (const std::uint64_t neighbours : neighbour_masks(bit, {})) here |= neighbours;
    for (std::size_t face = 0; face < 6; ++face) {
      const std::uint64_t beside = spill[face ^ 1U];
      if (beside == 0) continue;
      const Result<std::uint32_t> number = tiles_.ensure_beside(own, face);
      if (number.status() == Status::kOutOfRange) continue;
      if (!number.ok()) return false;
      visit(*number, beside);
    }
  }
  visit(own, here);
  return true;
}

template <class Visit>
bool Integrator::for_units_planned(const ScanTiles::Place& place, const PointPlan& plan,
                                   Visit&& visit) noexcept {
  if (config_.mode == InferenceMode::kKernel) return for_units_reached(plan.own, place, visit);
  for (const UnitsOfTile& reached : std::span(plan.reached).first(plan.reached_count))
    visit(reached.tile, reached.units);
  return true;
}

/// What the units around a point in a new unit need.
bool Integrator::plan_units(const LocalMap& map, const NewUnit& unit, PointPlan& plan) noexcept {
  if (unit.tile != 0) {
    plan.own = unit.tile - 1;
  } else {
    const Result<std::uint32_t> own = tiles_.ensure(unit.place.tile);
    if (!own.ok()) return false;
    plan.own = *own;
  }
  tiles_.tiles()[plan.own].occupied |= unit_bit(unit.place.unit);
  return for_units_reached(plan.own, unit.place, [&](std::uint32_t number, std::uint64_t reached) {
    Tile& tile = tiles_.tiles()[number];
    const std::uint64_t receiving = receiving_units(tile, reached);
    if (config_.mode != InferenceMode::kKernel)
      plan.reached[plan.reached_count++] = {number, receiving};
    const std::uint64_t units = receiving & ~tile.reserved;
    if (units != 0) count_tile(map, tile, units, tile.reserved, plan.wanted);
  });
}

/// What the ray needs: walks no farther than to the first block that does not fit.
Integrator::Refusal Integrator::plan_ray(LocalMap& map, const ScanPoint& end,
                                         PointPlan& plan) noexcept {
  const Status crossed = free_space_.cross(end, [&](RayBlock& ray_block) {
    if (ray_block.reserved) return true;
    const SlabPool::Counts before = plan.wanted;
    count_ray_block(map, ray_block, plan.wanted);
    return plan.wanted == before || map.fits(plan.wanted);
  });
  if (crossed == Status::kResourceExhausted) return Refusal::kRayBlocks;
  return map.fits_or_refuse(plan.wanted) ? Refusal::kNone : Refusal::kStorage;
}

/// The plan of a point and its ray beyond what is reserved; new_unit: null if an admitted point
/// lies in the point's unit.
Integrator::Refusal Integrator::plan_point(LocalMap& map, const ScanPoint& point,
                                           const NewUnit* new_unit, PointPlan& plan) noexcept {
  if (new_unit != nullptr) {
    if (!plan_units(map, *new_unit, plan)) return Refusal::kTiles;
    if (!map.fits_or_refuse(plan.wanted)) return Refusal::kStorage;  // before the ray is walked
  }
  return config_.free_space.enabled ? plan_ray(map, point, plan) : Refusal::kNone;
}

/// Opens the plan's blocks and marks as reserved what it holds. Storage has room for all of it; the
/// map's index may refuse a block: what was opened until then is taken back after the scan.
bool Integrator::open_plan(LocalMap& map, const NewUnit* new_unit, const PointPlan& plan) noexcept {
  const std::span<const std::uint32_t> crossed =
      config_.free_space.enabled ? free_space_.crossed() : std::span<const std::uint32_t>{};
  bool opened = true;
  for (const std::uint32_t number : crossed) {
    RayBlock& ray_block = free_space_.blocks()[number];
    if (!opened || ray_block.block != 0) continue;
    const Result<SlabHandle> block = map.open_block(ray_block.coord);
    opened = block.ok();
    if (opened) ray_block.block = *block;
  }
  const auto for_units = [&](auto&& visit) {
    if (new_unit == nullptr || !opened) return;
    const bool all_there = for_units_planned(new_unit->place, plan, visit);
    opened = opened && all_there;  // visit may have said no
  };
  for_units([&](std::uint32_t number, std::uint64_t units) {
    opened = opened && open_tile(map, tiles_.tiles()[number], units);
  });
  if (!opened) return false;
  for_units(
      [&](std::uint32_t number, std::uint64_t units) { tiles_.tiles()[number].reserved |= units; });
  for (const std::uint32_t number : crossed) free_space_.blocks()[number].reserved = true;
  return true;
}

Integrator::Refusal Integrator::reserve(LocalMap& map, const ScanPoint& point, bool is_point,
                                        SlabPool::Counts& reserved) noexcept {
  const std::size_t tiles = tiles_.tiles().size();
  const std::size_t ray_blocks = free_space_.blocks().size();
  NewUnit unit{.place = ScanTiles::place_of(point.voxel, tiles_.unit_edge())};
  const Tile* const before = is_point ? tiles_.find(unit.place.tile) : nullptr;
  if (before != nullptr) unit.tile = static_cast<std::uint32_t>(before - tiles_.tiles().data()) + 1;
  const bool is_new =
      is_point && (before == nullptr || (before->occupied & unit_bit(unit.place.unit)) == 0);
  const NewUnit* const new_unit = is_new ? &unit : nullptr;
  PointPlan plan{.wanted = reserved};
  Refusal refusal = plan_point(map, point, new_unit, plan);
  if (refusal == Refusal::kNone && !open_plan(map, new_unit, plan)) {
    open_failed_ = true;
    refusal = Refusal::kStorage;
  }
  if (refusal == Refusal::kNone) {
    reserved = plan.wanted;
    reserved[kBlockSlab] = 0;  // opened by now
    return refusal;
  }
  if (unit.tile != 0 && is_new)
    tiles_.tiles()[unit.tile - 1].occupied &= ~unit_bit(unit.place.unit);
  tiles_.truncate(tiles);
  free_space_.truncate(ray_blocks);
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
  SlabPool::Counts reserved{};
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
                             .origin_map = origin_map_,
                             .origin_voxel = origin_voxel_,
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
      const Refusal refusal = reserve(map, point, is_point, reserved);
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
