// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What an integrator does where a scan sees through what is in the map (docs/design/theory.md,
// Evidence that can be contradicted).
#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

/// A thing's voxels are within so many of one that is known to be of a class that may move.
constexpr int kBesideMoving = 2;
/// Of blocks that may hold what moves, from one reading of the clock to the next.
constexpr std::size_t kMovingBatch = 64;
/// How many voxels farther what was met must be.
constexpr float kSomeMargin_voxels = 3.0F;
constexpr float kAllMargin_voxels = 0.5F;  // behind the voxel

template <class Combine>
VoxelMask combine(const VoxelMask& a, const VoxelMask& b, Combine&& combine) noexcept {
  VoxelMask result;
  for (std::size_t z = 0; z < result.size(); ++z) result[z] = combine(a[z], b[z]);
  return result;
}
VoxelMask either(const VoxelMask& a, const VoxelMask& b) noexcept {
  return combine(a, b, [](std::uint64_t x, std::uint64_t y) { return x | y; });
}
VoxelMask both(const VoxelMask& a, const VoxelMask& b) noexcept {
  return combine(a, b, [](std::uint64_t x, std::uint64_t y) { return x & y; });
}
VoxelMask without(const VoxelMask& a, const VoxelMask& b) noexcept {
  return combine(a, b, [](std::uint64_t x, std::uint64_t y) { return x & ~y; });
}

/// The voxels of a block that are at most one beside those in the mask, on each axis.
VoxelMask widened(const VoxelMask& mask) noexcept {
  VoxelMask flat;
  for (std::size_t z = 0; z < mask.size(); ++z) {
    const std::uint64_t word = mask[z];
    const std::uint64_t rows =
        word | ((word << 1U) & 0xfefefefefefefefeU) | ((word >> 1U) & 0x7f7f7f7f7f7f7f7fU);
    flat[z] = rows | (rows << 8U) | (rows >> 8U);
  }
  VoxelMask result = flat;
  for (std::size_t z = 0; z + 1 < mask.size(); ++z) {
    result[z] |= flat[z + 1];
    result[z + 1] |= flat[z];
  }
  return result;
}

}  // namespace

/// So that blocks in which nothing is free by the wider windows of carving are looked at too.
void Integrator::look_at_moving(const LocalMap& map, std::uint64_t to_write,
                                std::uint64_t most_steps) noexcept {
  FreeSpace& free_space = scratch_.free_space;
  std::size_t visited = 0;
  map.visit_moving([&](SlabHandle handle) {
    if (visited++ % kMovingBatch == 0 &&
        !work_.in_time(to_write + work_.to_write(free_space.blocks().size()))) {
      carving_cut_ = true;
      return false;
    }
    const BlockCoord coord = unpack(BlockKey{map.block_at(handle).key});
    if (!carver_.in_reach(coord)) return true;
    const bool fits = carve_steps_ + ImageCarver::kBlockSteps <= most_steps &&
                      free_space.words_of(coord, 2) != nullptr;
    carve_steps_ += fits ? ImageCarver::kBlockSteps : 0;
    carving_cut_ = carving_cut_ || !fits;
    return fits;
  });
}

/// A voxel behind the point and half of one that others' frames are off by.
void Integrator::look_at_watched(const Lattice& lattice, std::span<WatchedPoint> watched) noexcept {
  constexpr float kMargin_voxels = 1.5F;
  for (WatchedPoint& point : watched) {
    const Point3f p_map(point.p_map[0], point.p_map[1], point.p_map[2]);
    const Result<VoxelCoord> voxel = lattice.voxel_of(p_map);
    point.is_seen_through = carver_.sees_through(p_map, kMargin_voxels);
    point.is_hit = voxel.ok() && scratch_.free_space.is_hit(*voxel);
  }
}

void Integrator::contradict(LocalMap& map, SlabHandle handle, const RayBlock& seen,
                            const VoxelMask& carved, ScanReport& report) noexcept {
  const VoxelMask in_all = carver_.seen_through(seen.coord, SeenBy::kAll, kAllMargin_voxels);
  const VoxelMask either_way = either(in_all, carved);
  const LocalMap::Occupied occupied = map.occupied(handle, either_way);
  // What was only looked at for what moves must not depend on whether the block was listed.
  if (seen.block == 0 && !occupied.any_moving) return;
  // Of a thing that is met beside the voxel, some rays miss this part.
  const VoxelMask beside_hit = widened(seen.hit);
  const VoxelMask both_ways = without(both(in_all, carved), beside_hit);
  const VoxelMask here = without(occupied.all, seen.hit);
  VoxelMask gone{};
  if (occupied.any_moving) {
    VoxelMask near_moving = occupied.moving;
    for (int i = 0; i < kBesideMoving; ++i) near_moving = widened(near_moving);
    const VoxelMask in_some = carver_.seen_through(seen.coord, SeenBy::kSome, kSomeMargin_voxels);
    const VoxelMask likely = either(both(in_some, occupied.moving),
                                    both(either_way, without(near_moving, occupied.moving)));
    const VoxelMask surely = both(both(in_some, both_ways), near_moving);
    gone = both(here, either(both(likely, occupied.faint), surely));
  }
  const VoxelMask doubted = without(
      both(here, either(both_ways, without(both(either_way, occupied.faint), beside_hit))), gone);
  // Before labels go, as the pages of passes are those that were planned for.
  if (seen.block != 0) {
    const Status status = map.add_free_pass(handle, without(carved, occupied.all));
    TESSERA_ASSERT(status == Status::kOk);
    ++(status == Status::kOk ? report.free_blocks : report.write_faults);
  }
  std::uint64_t any = 0;
  for (std::size_t z = 0; z < doubted.size(); ++z) any |= doubted[z] | gone[z];
  if (any != 0) {
    const Contradicted done = map.contradict(handle, doubted, gone);
    report.voxels_doubted += done.doubted;
    report.voxels_cleared += done.cleared;
    const Block& block = map.block_at(handle);
    emptied_ = emptied_ || (!block.has_labels() && !block.has_free_passes());
  }
}

}  // namespace tessera
