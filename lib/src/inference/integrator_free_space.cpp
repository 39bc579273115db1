// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What an integrator does with the free space of a scan.
#include "tessera/inference/integrator.hpp"
#include "tessera/inference/internal/storage_needs.hpp"
#include "tessera/inference/internal/write_in_time.hpp"

namespace tessera {

/// What the labels may take of a work budget comes first.
void Integrator::carve(const LocalMap& map) noexcept {
  if (!image_made_) carver_.see(points_, config_);
  image_made_ = true;
  const std::uint64_t labels = admitted().size() * work_.most_per_point();
  const std::uint64_t limit = config_.work_budget == 0 ? ~std::uint64_t{0} : config_.work_budget;
  const std::uint64_t spent = labels + carve_steps_;
  const std::uint64_t left = limit > spent ? limit - spent : 0;
  const std::uint64_t to_write = admitted().size() * work_.foreseen_per_point();
  carving_cut_ =
      !carver_.carve(map.lattice(), config_.free_space, scratch_.free_space, work_, to_write, left);
  carve_steps_ += carver_.steps();
  look_at_moving(map, to_write, limit > labels ? limit - labels : 0);
  scratch_.free_space.mark_hits(points_.returns());
  scratch_.free_space.finish();
}

/// What is kept is opened at once, so that opening cannot fail later.
void Integrator::drop_what_does_not_fit(LocalMap& map, ScanReport& report) noexcept {
  SlabPool::Counts wanted = reserved_;
  visit_by_rings(scratch_.free_space.blocks(), block_of(points_.origin_voxel()),
                 [&](RayBlock& ray_block) {
                   if (!ray_block.carves()) return;
                   const SlabPool::Counts before = wanted;
                   count_ray_block(map, ray_block, wanted);
                   if (map.fits(wanted)) {
                     const Result<SlabHandle> block = map.open_block(ray_block.coord);
                     if (block.ok()) {
                       ray_block.block = *block;
                       wanted[kBlockSlab] = before[kBlockSlab];  // taken by now
                       return;
                     }
                     open_failed_ = true;
                   }
                   wanted = before;
                   ray_block.passed = {};
                   ++report.free_blocks_refused;
                 });
}

namespace {

/// Fetches what write_free_space() reads of the next blocks: of one the header, of the one before
/// the pages of passes that it names.
[[gnu::always_inline]] inline void prefetch_blocks(const LocalMap& map,
                                                   std::span<const RayBlock> blocks,
                                                   const RayBlock& current) noexcept {
  const auto at = static_cast<std::size_t>(&current - blocks.data());
  if (at + 2 < blocks.size() && blocks[at + 2].block != 0)
    __builtin_prefetch(map.pool().at(blocks[at + 2].block), 1);
  if (at + 1 >= blocks.size() || blocks[at + 1].block == 0) return;
  for (const SlabHandle page : map.block_at(blocks[at + 1].block).free_passes) {
    if (page == 0) continue;
    __builtin_prefetch(map.pool().at(page), 1);
    __builtin_prefetch(map.pool().at(page) + sizeof(FreePage) / 2, 1);
  }
}

}  // namespace

void Integrator::write_free_space(LocalMap& map, ScanReport& report) noexcept {
  const std::span<const RayBlock> blocks = scratch_.free_space.blocks();
  const auto write = [&](const RayBlock& ray_block) {
    prefetch_blocks(map, blocks, ray_block);
    VoxelMask carved;
    for (std::size_t z = 0; z < carved.size(); ++z)
      carved[z] = ray_block.passed[z] & ~ray_block.hit[z];
    if (config_.free_space.uses_image()) {
      const SlabHandle block =
          ray_block.block != 0 ? ray_block.block : map.find_handle(ray_block.coord);
      if (block != 0 && (map.block_at(block).has_labels() || map.may_move(block)))
        return contradict(map, block, ray_block, carved, report);
    }
    if (ray_block.block == 0) return;
    const Status status = map.add_free_pass(ray_block.block, carved);
    TESSERA_ASSERT(status == Status::kOk);
    ++(status == Status::kOk ? report.free_blocks : report.write_faults);
  };
  const auto leave = [&](const RayBlock& ray_block) {
    // One that is only to be looked at is open in the map, too.
    const bool is_left = ray_block.block != 0 ||
                         (config_.free_space.uses_image() && map.find_handle(ray_block.coord) != 0);
    report.ray_blocks_cut += is_left ? 1U : 0U;
  };
  write_in_time(blocks, block_of(points_.origin_voxel()), kBlockBatch, work_, write, leave);
  if (config_.free_space.uses_image()) {
    report.rays =
        static_cast<std::uint32_t>(points_.returns().size() + points_.returns_beyond().size());
    return;
  }
  report.rays_cut = static_cast<std::uint32_t>(tracer_.rays_cut());
  report.rays =
      static_cast<std::uint32_t>(admitted().size() + admitted_rays().size() - tracer_.rays_cut());
}

/// Blocks were opened by a bound; those that nothing was written to are taken back.
void Integrator::close_unwritten_blocks(LocalMap& map, bool all_written) noexcept {
  if (open_failed_) return map.close_empty_blocks();
  // Tiles and rays share blocks, and each must be closed once.
  const auto close = [&map](const BlockCoord& coord) {
    if (map.find(coord) != nullptr) map.close_if_empty(*map.open_block(coord));
  };
  const int edge = scratch_.tiles.unit_edge();
  for (const Tile& tile : scratch_.tiles.tiles()) {
    for (int i = 0; i < blocks_of_tile(edge); ++i) {
      const SlabHandle block = tile.blocks[static_cast<std::size_t>(i)];
      if (!all_written || (block != 0 && edge == 1)) {
        close(block_of_tile(tile.coord, edge, i));
      } else if (((unsigned{tile.opened} >> static_cast<unsigned>(i)) & 1U) != 0) {
        map.close_if_empty(block);
      }
    }
  }
  if ((all_written && !emptied_) || !config_.free_space.enabled) return;
  for (const RayBlock& ray_block : scratch_.free_space.blocks()) close(ray_block.coord);
}

}  // namespace tessera
