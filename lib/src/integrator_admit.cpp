// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Admission: what the scan's points may need, and whether it is there. Everything here is an upper bound that the writing
// stays under; blocks opened and not written are closed again.
#include "tessera/inference/integrator.hpp"
#include "tessera/inference/kernel.hpp"

namespace tessera {

namespace {

constexpr std::array<BlockCoord, 6> kFaces{
    BlockCoord{-1, 0, 0}, BlockCoord{1, 0, 0}, BlockCoord{0, -1, 0},
    BlockCoord{0, 1, 0},  BlockCoord{0, 0, -1}, BlockCoord{0, 0, 1}};

constexpr BlockCoord operator+(const BlockCoord& a, const BlockCoord& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}

}  // namespace

bool Integrator::want_units(const LocalMap& map) noexcept {
  if (config_.mode == InferenceMode::kKernel) return want_kernel_units();
  const std::size_t with_points = tiles_.tiles().size();
  for (std::size_t i = 0; i < with_points; ++i) tiles_.tiles()[i].wanted = tiles_.tiles()[i].occupied;
  if (config_.mode == InferenceMode::kCounting) return true;
  measure_units(tiles_, map.classes().num_classes());
  // Filling takes points in at least one face neighbour, so only tiles beside a tile with points on that face matter.
  for (std::size_t i = 0; i < with_points; ++i) {
    const std::uint64_t occupied = tiles_.tiles()[i].occupied;
    const std::array<std::uint64_t, 6> spill = neighbour_masks(0, {occupied, occupied, occupied, occupied, occupied, occupied});
    for (std::size_t face = 0; face < 6; ++face) {
      // spill[f ^ 1] is non-zero iff this tile has points on the side that touches the neighbour at face f.
      if (spill[face ^ 1U] == 0) continue;
      const BlockCoord beside = tiles_.tiles()[i].coord + kFaces[face];
      if (!in_grid(beside)) continue;
      if (!tiles_.ensure(beside).ok()) return false;
    }
  }
  for (Tile& tile : tiles_.tiles()) {
    std::array<std::uint64_t, 6> faces{};
    for (std::size_t face = 0; face < 6; ++face) {
      const Tile* const beside = tiles_.find(tile.coord + kFaces[face]);
      faces[face] = beside == nullptr ? 0 : beside->occupied;
    }
    const std::uint64_t filled =
        at_least(neighbour_masks(tile.occupied, faces), config_.entropy.fill_neighbours) & ~tile.occupied;
    tile.wanted = tile.occupied | filled;
  }
  return true;
}

bool Integrator::want_kernel_units() noexcept {
  const int reach = kernel_reach_units_;
  const std::size_t with_points = tiles_.tiles().size();
  for (std::size_t i = 0; i < with_points; ++i) {
    for (std::uint64_t rest = tiles_.tiles()[i].occupied; rest != 0; rest &= rest - 1) {
      const int unit = std::countr_zero(rest);
      if (!for_units_around(tiles_.tiles()[i].coord, unit, reach, [&](const BlockCoord& coord, std::uint64_t box) {
            if (!in_grid(coord)) return true;
            const Result<std::uint32_t> tile = tiles_.ensure(coord);
            if (!tile.ok()) return false;
            tiles_.tiles()[*tile].wanted |= box;
            return true;
          })) {
        return false;
      }
    }
  }
  return true;
}

std::uint64_t Integrator::evaluations_per_point() const noexcept {
  switch (config_.mode) {
    case InferenceMode::kCounting: return 1;
    case InferenceMode::kKernel: {
      const auto side = static_cast<std::uint64_t>(2.0F * kernel_radius_ + 2.0F);
      return side * side * side;
    }
    case InferenceMode::kMultiEntropy: break;
  }
  const auto edge = static_cast<std::uint64_t>(unit_edge());
  return 7 * edge * edge * edge;
}

bool Integrator::trace_rays(const LocalMap& map) noexcept {
  free_space_.begin(config_.free_space, map.lattice(), origin_map_);
  for (const ScanPoint& point : admitted()) {
    free_space_.add_return(point.p_map);
    if (free_space_.mark_hit(*map.lattice().voxel_of(point.p_map)) != Status::kOk) return false;
  }
  for (const ScanPoint& point : admitted()) {
    if (free_space_.trace(point.p_map, true) != Status::kOk) return false;
  }
  for (const ScanPoint& ray : admitted_rays()) {
    if (free_space_.trace(ray.p_map, false) != Status::kOk) return false;
  }
  return true;
}

void Integrator::count_needs(const LocalMap& map, const Tile& tile, std::uint64_t units, std::uint64_t counted,
                             SlabPool::Counts& wanted) const noexcept {
  const int edge = tiles_.unit_edge();
  // With the default edge a tile is one block, so its label page was counted iff any unit of it was.
  const bool page_counted_before = edge == 2 && counted != 0;
  std::array<bool, 8> page_counted{};
  for (std::uint64_t rest = units; rest != 0; rest &= rest - 1) {
    std::array<OctetPlace, 8> octets;
    const int n = octets_of_unit(std::countr_zero(rest), edge, octets);
    for (int i = 0; i < n; ++i) {
      const BlockOctet at = locate(tile, octets[static_cast<std::size_t>(i)], edge);
      const SlabHandle handle = tile.blocks[static_cast<std::size_t>(at.block)];
      if (handle == 0) continue;  // out of the grid
      const Block& block = map.block_at(handle);
      if (!map.has_octet(block, at.octet)) ++wanted[kOctetSlab];
      bool& page = page_counted[static_cast<std::size_t>(at.block)];
      if (block.labels == 0 && !page && !page_counted_before) ++wanted[kLabelSlab];
      page = true;
    }
  }
}

bool Integrator::open_tile(LocalMap& map, Tile& tile) noexcept {
  for (int i = 0; i < blocks_of_tile(tiles_.unit_edge()); ++i) {
    const BlockCoord coord = block_of_tile(tile.coord, tiles_.unit_edge(), i);
    if (!in_grid(coord)) continue;
    const Result<SlabHandle> block = map.open_block(coord);
    if (!block.ok()) return false;
    tile.blocks[static_cast<std::size_t>(i)] = *block;
  }
  return true;
}

bool Integrator::open_blocks(LocalMap& map) noexcept {
  SlabPool::Counts wanted{};
  for (Tile& tile : tiles_.tiles()) {
    if (tile.wanted == 0) continue;
    if (!open_tile(map, tile)) return false;
    count_needs(map, tile, tile.wanted, 0, wanted);
  }
  if (config_.free_space.enabled) {
    for (RayBlock& ray_block : free_space_.blocks()) {
      if (!ray_block.carves()) continue;
      const Result<SlabHandle> block = map.open_block(ray_block.coord);
      if (!block.ok()) return false;
      ray_block.block = *block;
      if (map.block_at(*block).free_passes == 0) ++wanted[kFreeSlab];
    }
  }
  return map.fits(wanted);
}

bool Integrator::prepare(LocalMap& map) noexcept {
  const auto within_budget = [&] {
    if (config_.work_budget == 0) return true;
    std::uint64_t work = admitted_count_ * evaluations_per_point();
    if (config_.free_space.enabled) {
      for (const ScanPoint& point : admitted()) work += free_space_.most_steps(point.p_map);
      for (const ScanPoint& ray : admitted_rays()) work += free_space_.most_steps(ray.p_map);
    }
    return work <= config_.work_budget;
  };
  if (config_.free_space.enabled) free_space_.begin(config_.free_space, map.lattice(), origin_map_);
  return within_budget() && tiles_.build(admitted(), map.lattice(), unit_edge(), sort_) == Status::kOk &&
         want_units(map) && (!config_.free_space.enabled || trace_rays(map)) && open_blocks(map);
}

}  // namespace tessera
