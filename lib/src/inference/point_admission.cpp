// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/point_admission.hpp"

#include <array>
#include <bit>

namespace tessera {

std::uint32_t& PointAdmission::refusal_counter(ScanReport& report, Refusal refusal) noexcept {
  switch (refusal) {
    case Refusal::kTiles:
      return report.refused_tiles;
    case Refusal::kRayBlocks:
      return report.refused_ray_blocks;
    default:
      return report.refused_storage;
  }
}

/// Calls visit(number of a tile, its units that the point may contribute to), making the tiles.
/// False: tiles or their index are full.
template <class Visit>
bool PointAdmission::for_units_reached(std::uint32_t own, const ScanTiles::Place& place,
                                       Visit&& visit) noexcept {
  const std::uint64_t bit = unit_bit(place.unit);
  if (config_.mode == InferenceMode::kKernel) {
    return for_units_around(place.tile, place.unit, reach_.units,
                            [&](const BlockCoord& coord, std::uint64_t reached) {
                              if (!in_grid(coord)) return true;
                              const Result<std::uint32_t> number = scratch_.tiles.ensure(coord);
                              if (number.ok()) visit(*number, reached);
                              return number.ok();
                            });
  }
  std::uint64_t here = bit;
  if (by_entropies(config_.mode)) {
    const std::array<std::uint64_t, 6> spill = neighbour_masks(0, {bit, bit, bit, bit, bit, bit});
    for (const std::uint64_t neighbours : neighbour_masks(bit, {})) here |= neighbours;
    for (std::size_t face = 0; face < 6; ++face) {
      const std::uint64_t beside = spill[face ^ 1U];
      if (beside == 0) continue;
      const Result<std::uint32_t> number = scratch_.tiles.ensure_beside(own, face);
      if (number.status() == Status::kOutOfRange) continue;
      if (!number.ok()) return false;
      visit(*number, beside);
    }
  }
  visit(own, here);
  return true;
}

template <class Visit>
bool PointAdmission::for_units_planned(const ScanTiles::Place& place, const PointPlan& plan,
                                       Visit&& visit) noexcept {
  if (config_.mode == InferenceMode::kKernel) return for_units_reached(plan.own, place, visit);
  for (const UnitsOfTile& reached : std::span(plan.reached).first(plan.reached_count))
    visit(reached.tile, reached.units);
  return true;
}

/// What the units around a point in a new unit need.
bool PointAdmission::plan_units(const NewUnit& unit, PointPlan& plan) noexcept {
  if (unit.tile != 0) {
    plan.own = unit.tile - 1;
  } else {
    const Result<std::uint32_t> own = scratch_.tiles.ensure(unit.place.tile);
    if (!own.ok()) return false;
    plan.own = *own;
  }
  scratch_.tiles.tiles()[plan.own].occupied |= unit_bit(unit.place.unit);
  return for_units_reached(plan.own, unit.place, [&](std::uint32_t number, std::uint64_t reached) {
    Tile& tile = scratch_.tiles.tiles()[number];
    const std::uint64_t receiving = receiving_units(scratch_.tiles, config_, tile, reached);
    if (config_.mode != InferenceMode::kKernel)
      plan.reached[plan.reached_count++] = {number, receiving};
    const std::uint64_t units = receiving & ~tile.reserved;
    if (units != 0)
      count_tile(map_, scratch_.tiles.unit_edge(), tile, units, tile.reserved, plan.wanted);
  });
}

/// What the ray needs: walks no farther than to the first block that does not fit.
PointAdmission::Refusal PointAdmission::plan_ray(const ScanPoint& end, PointPlan& plan) noexcept {
  const Status crossed = scratch_.free_space.cross(end, [&](RayBlock& ray_block) {
    if (ray_block.reserved) return true;
    const SlabPool::Counts before = plan.wanted;
    count_ray_block(map_, ray_block, plan.wanted);
    return plan.wanted == before || map_.fits(plan.wanted);
  });
  if (crossed == Status::kResourceExhausted) return Refusal::kRayBlocks;
  return map_.fits_or_refuse(plan.wanted) ? Refusal::kNone : Refusal::kStorage;
}

/// The plan of a point and its ray beyond what is reserved; new_unit: null if an admitted point
/// lies in the point's unit.
PointAdmission::Refusal PointAdmission::plan_point(const ScanPoint& point, const NewUnit* new_unit,
                                                   PointPlan& plan) noexcept {
  if (new_unit != nullptr) {
    if (!plan_units(*new_unit, plan)) return Refusal::kTiles;
    if (!map_.fits_or_refuse(plan.wanted)) return Refusal::kStorage;  // before the ray is walked
  }
  return config_.free_space.walks_rays() ? plan_ray(point, plan) : Refusal::kNone;
}

/// Opens the plan's blocks and marks as reserved what it holds. Storage has room for all of it; the
/// map's index may refuse a block: what was opened until then is taken back after the scan.
bool PointAdmission::open_plan(const NewUnit* new_unit, const PointPlan& plan) noexcept {
  const std::span<const std::uint32_t> crossed = config_.free_space.walks_rays()
                                                     ? scratch_.free_space.crossed()
                                                     : std::span<const std::uint32_t>{};
  bool opened = true;
  for (const std::uint32_t number : crossed) {
    RayBlock& ray_block = scratch_.free_space.blocks()[number];
    if (!opened || ray_block.block != 0) continue;
    const Result<SlabHandle> block = map_.open_block(ray_block.coord);
    opened = block.ok();
    if (opened) ray_block.block = *block;
  }
  const auto for_units = [&](auto&& visit) {
    if (new_unit == nullptr || !opened) return;
    const bool all_there = for_units_planned(new_unit->place, plan, visit);
    opened = opened && all_there;  // visit may have said no
  };
  for_units([&](std::uint32_t number, std::uint64_t units) {
    opened = opened &&
             open_tile(map_, scratch_.tiles.unit_edge(), scratch_.tiles.tiles()[number], units);
  });
  if (!opened) return false;
  for_units([&](std::uint32_t number, std::uint64_t units) {
    scratch_.tiles.tiles()[number].reserved |= units;
  });
  for (const std::uint32_t number : crossed) scratch_.free_space.blocks()[number].reserved = true;
  return true;
}

PointAdmission::Refusal PointAdmission::reserve(const ScanPoint& point, bool is_point) noexcept {
  const std::size_t tiles = scratch_.tiles.tiles().size();
  const std::size_t ray_blocks = scratch_.free_space.blocks().size();
  NewUnit unit{.place = ScanTiles::place_of(point.voxel, scratch_.tiles.unit_edge())};
  const Tile* const before = is_point ? scratch_.tiles.find(unit.place.tile) : nullptr;
  if (before != nullptr)
    unit.tile = static_cast<std::uint32_t>(before - scratch_.tiles.tiles().data()) + 1;
  const bool is_new =
      is_point && (before == nullptr || (before->occupied & unit_bit(unit.place.unit)) == 0);
  const NewUnit* const new_unit = is_new ? &unit : nullptr;
  PointPlan plan{.wanted = reserved_};
  Refusal refusal = plan_point(point, new_unit, plan);
  if (refusal == Refusal::kNone && !open_plan(new_unit, plan)) {
    index_refused_ = true;
    refusal = Refusal::kStorage;
  }
  if (refusal == Refusal::kNone) {
    reserved_ = plan.wanted;
    reserved_[kBlockSlab] = 0;  // opened by now
    return refusal;
  }
  if (unit.tile != 0 && is_new)
    scratch_.tiles.tiles()[unit.tile - 1].occupied &= ~unit_bit(unit.place.unit);
  scratch_.tiles.truncate(tiles);
  scratch_.free_space.truncate(ray_blocks);
  return refusal;
}

void PointAdmission::admit(ScanWork& limit, bool spread, ScanReport& report) noexcept {
  const bool carving = config_.free_space.walks_rays();
  std::uint64_t work = report.ray_steps;  // on trial
  std::uint64_t to_write = 0;             // of the work, what comes after admission
  bool spent = false;
  std::size_t asked = 0;
  const std::size_t count = points_.admitted().size();
  // A second point in a unit takes work and no storage, so only where work runs out is it better to
  // have the first of more units.
  for (const KeyedIndex& item : points_.in_order(unit_edge_of(config_), carving, spread)) {
    const bool is_point = item.index < count;
    const ScanPoint& point = points_.end_of_ray(item.index);
    const std::uint64_t steps = carving ? scratch_.free_space.most_steps(point.p_map) : 0;
    const std::uint64_t cost = (is_point ? limit.most_per_point() : 0) + 2 * steps;
    spent = spent || limit.is_spent(work + cost, to_write, asked);
    std::uint32_t* counter = &limit.refusals(report, is_point);
    if (!spent) {
      const std::uint64_t steps_before = scratch_.free_space.steps();
      const Refusal refusal = reserve(point, is_point);
      if (refusal == Refusal::kNone) {
        work += cost;
        to_write += cost - steps;
        rays_predicted_ += steps;
        continue;
      }
      work += scratch_.free_space.steps() - steps_before;
      counter = is_point ? &refusal_counter(report, refusal) : &report.rays_refused_memory;
    }
    ++*counter;
    points_.refuse(item.index);
  }
  report.work_predicted = report.work_limit == 0 ? 0 : work;
  points_.drop_refused();
}

}  // namespace tessera
