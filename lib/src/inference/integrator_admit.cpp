// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Admission: what the scan's points may need, and whether it is there. Everything here is an upper
// bound that the writing stays under; blocks opened and not written are closed again.
#include "tessera/base/internal/bits.hpp"
#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

/// The layers of a block that units of a tile lie in, a bit each; units: all in block number i.
unsigned layers_of_units(const Tile& tile, int unit_edge, int i, std::uint64_t units) noexcept {
  unsigned rows = 0;  // of units, in z
  for (unsigned z = 0; z < 4; ++z) rows |= ((units >> (16 * z)) & 0xffffU) != 0 ? 1U << z : 0U;
  if (unit_edge == 2) return rows;
  if (unit_edge == 1) {
    const unsigned pair = ((rows & 3U) != 0 ? 1U : 0U) | ((rows & 12U) != 0 ? 2U : 0U);
    return (tile.coord.z & 1) != 0 ? pair << 2U : pair;
  }
  const unsigned half = i >= 4 ? rows >> 2U : rows;
  return ((half & 1U) != 0 ? 3U : 0U) | ((half & 2U) != 0 ? 12U : 0U);
}

unsigned layers_with_labels(const Block* block) noexcept {
  unsigned layers = 0;
  for (std::size_t i = 0; block != nullptr && i < kBlockLayers; ++i)
    layers |= (block->labels[i] != 0 ? 1U : 0U) << i;
  return layers;
}

/// Octets that these units of a tile would take, all in one of the map's blocks, beyond those that
/// the block has.
std::uint32_t new_octets(const Tile& tile, int edge, std::uint64_t units,
                         std::uint64_t present) noexcept {
  if (edge == 2) return static_cast<std::uint32_t>(count_ones(units & ~present));  // a unit each
  std::uint32_t count = 0;
  for (; units != 0; units &= units - 1) {
    const UnitOctets octets = octets_of_unit(std::countr_zero(units), edge);
    for (const OctetPlace& place : octets.places()) {
      const int octet = locate(tile, place, edge).octet;
      count += ((present >> static_cast<unsigned>(octet)) & 1U) != 0 ? 0U : 1U;
    }
  }
  return count;
}

}  // namespace

std::uint64_t Integrator::evaluations_per_point() const noexcept {
  switch (config_.mode) {
    case InferenceMode::kCounting:
      return 1;
    case InferenceMode::kKernel: {
      // Beyond that no budget is met, and products with the number of points would wrap.
      constexpr std::uint64_t kWidest = 4096;
      const auto side = static_cast<std::uint64_t>(2.0F * kernel_radius_ + 2.0F);
      return side > kWidest ? kWidest * kWidest * kWidest : side * side * side;
    }
    case InferenceMode::kMultiEntropy:
      break;
  }
  const auto edge = static_cast<std::uint64_t>(unit_edge());
  return 7 * edge * edge * edge;
}

bool Integrator::trace_rays() noexcept {
  if (free_space_.add_returns(admitted()) != Status::kOk) return false;
  // Marks are a set, so with a deadline every sixteenth ray comes first, then those beside them:
  // what is traced when time runs short is spread over all directions. The next scan goes on where
  // it ran short, so that a robot which stands sees along all rays in the end.
  const std::size_t sweeps = deadline_ == nullptr ? 1 : kRaySweeps;
  const std::uint64_t to_write = admitted_count_ * foreseen_per_point();
  const std::size_t rays = admitted_count_ + ray_count_;
  std::size_t traced = 0;
  const std::size_t first = first_sweep_ % sweeps;
  for (std::size_t n = 0; n < sweeps && rays_cut_ == 0; ++n) {
    const std::size_t sweep = (first + n) % sweeps;
    // Axis by axis, so that few blocks are turned more than once.
    for (int axis = 2; axis >= 0 && rays_cut_ == 0; --axis) {
      for (std::size_t i = sweep; i < rays; i += sweeps) {
        const Point3f& end_map = ray_end(i);
        if (free_space_.axis_of(end_map) != axis) continue;
        if (traced % kRayBatch == 0 &&
            !in_time(to_write + kBlockWork * free_space_.blocks().size())) {
          rays_cut_ = rays - traced;
          first_sweep_ = sweep;
          break;
        }
        if (free_space_.trace(end_map, i < admitted_count_) != Status::kOk) return false;
        ++traced;
      }
    }
  }
  free_space_.finish();
  return true;
}

void Integrator::count_tile(const LocalMap& map, Tile& tile, std::uint64_t units,
                            std::uint64_t counted, SlabPool::Counts& wanted) const noexcept {
  const int edge = tiles_.unit_edge();
  for (int i = 0; i < blocks_of_tile(edge); ++i) {
    const std::uint64_t here = units & units_of_block(edge, i);
    const BlockCoord coord = block_of_tile(tile.coord, edge, i);
    if (here == 0 || !in_grid(coord)) continue;
    SlabHandle& handle = tile.blocks[static_cast<std::size_t>(i)];
    if (handle == 0) handle = map.find_handle(coord);
    const Block* const block = handle == 0 ? nullptr : &map.block_at(handle);
    // With units of one voxel, tiles share a block and each counts it and its pages: a bound, not
    // the number.
    const std::uint64_t before = counted & units_of_block(edge, i);
    if (before == 0 && block == nullptr) ++wanted[kBlockSlab];
    const unsigned new_layers = layers_of_units(tile, edge, i, here) &
                                ~layers_of_units(tile, edge, i, before) &
                                ~layers_with_labels(block);
    wanted[kLabelSlab] += static_cast<std::uint32_t>(count_ones(new_layers));
    wanted[kOctetSlab] +=
        new_octets(tile, edge, here, block == nullptr ? 0 : map.octets_of(*block));
  }
}

/// The block is looked up once a scan, and again only while it is not open: a tile may open it.
void Integrator::count_ray_block(const LocalMap& map, RayBlock& ray_block,
                                 SlabPool::Counts& wanted) noexcept {
  if (!ray_block.looked_up || ray_block.block == 0) {
    ray_block.block = map.find_handle(ray_block.coord);
    const Block* const block = ray_block.block == 0 ? nullptr : &map.block_at(ray_block.block);
    // On admission one by one nothing is marked yet: the ray may pass through every layer.
    const bool marked = ray_block.carves();
    VoxelMask carved{};
    for (std::size_t z = 0; z < carved.size(); ++z)
      carved[z] = marked ? ray_block.passed[z] & ~ray_block.hit[z] : ~std::uint64_t{0};
    ray_block.free_pages =
        static_cast<std::uint8_t>(free_pages_needed(block == nullptr ? Block{} : *block, carved));
    ray_block.looked_up = true;
  }
  if (ray_block.block == 0) ++wanted[kBlockSlab];
  wanted[kFreeSlab] += ray_block.free_pages;
}

bool Integrator::open_tile(LocalMap& map, Tile& tile, std::uint64_t units) noexcept {
  const int edge = tiles_.unit_edge();
  for (int i = 0; i < blocks_of_tile(edge); ++i) {
    const BlockCoord coord = block_of_tile(tile.coord, edge, i);
    SlabHandle& handle = tile.blocks[static_cast<std::size_t>(i)];
    if ((units & units_of_block(edge, i)) == 0 || handle != 0 || !in_grid(coord)) continue;
    const Result<SlabHandle> block = map.open_block(coord);
    if (!block.ok()) return false;
    handle = *block;
    tile.opened |= static_cast<std::uint8_t>(1U << static_cast<unsigned>(i));
  }
  return true;
}

/// Asked before blocks are opened: one opened in vain would keep its page from other uses.
bool Integrator::fits_whole(const LocalMap& map) noexcept {
  SlabPool::Counts wanted{};
  for (Tile& tile : tiles_.tiles()) {
    if (tile.wanted != 0) count_tile(map, tile, tile.wanted, 0, wanted);
  }
  for (RayBlock& ray_block : ray_blocks()) {
    if (ray_block.carves()) count_ray_block(map, ray_block, wanted);
  }
  return map.fits(wanted);
}

bool Integrator::open_blocks(LocalMap& map) noexcept {
  for (Tile& tile : tiles_.tiles()) {
    if (tile.wanted == 0 || open_tile(map, tile, tile.wanted)) continue;
    open_failed_ = true;
    return false;
  }
  for (RayBlock& ray_block : ray_blocks()) {
    const bool carves = ray_block.carves();
    if (!carves) ray_block.block = 0;
    if (!carves || ray_block.block != 0) continue;
    const Result<SlabHandle> block = map.open_block(ray_block.coord);
    if (!block.ok()) {
      open_failed_ = true;
      return false;
    }
    ray_block.block = *block;
  }
  return true;
}

bool Integrator::within_limit(ScanReport& report) noexcept {
  over_limit_ = false;
  rays_predicted_ = 0;
  if (work_limit_ == kNoLimit) return true;
  if (config_.free_space.enabled) {
    for (const ScanPoint& point : admitted())
      rays_predicted_ += free_space_.most_steps(point.p_map);
    for (const ScanPoint& ray : admitted_rays())
      rays_predicted_ += free_space_.most_steps(ray.p_map);
  }
  const std::uint64_t work = admitted_count_ * evaluations_per_point() + rays_predicted_;
  // What a deadline has room for was seen to by shed_points(), and the clock does the rest.
  over_limit_ = config_.work_budget != 0 && work > config_.work_budget;
  if (!over_limit_) report.work_predicted = work;
  return !over_limit_;
}

bool Integrator::fill_scratch(const LocalMap& map) noexcept {
  rays_cut_ = 0;
  return tiles_.build(admitted(), map.lattice(), sort_) == Status::kOk && in_time() &&
         want_units(map) && in_time() && (!config_.free_space.enabled || trace_rays()) && in_time();
}

}  // namespace tessera
