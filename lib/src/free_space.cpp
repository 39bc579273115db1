// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/free_space.hpp"

#include <algorithm>
#include <cmath>

namespace tessera {

Result<FreeSpace> FreeSpace::make(Arena& arena, const ScanCapacity& capacity) noexcept {
  if (arena.remaining_bytes() < required_bytes(capacity)) return Status::kResourceExhausted;
  FreeSpace result;
  const Result<KeyIndex> index = KeyIndex::make(arena, capacity.ray_blocks);
  if (!index.ok()) return index.status();
  result.index_ = *index;
  result.blocks_ = arena.take<RayBlock>(capacity.ray_blocks);
  result.crossed_ = arena.take<std::uint32_t>(capacity.ray_blocks);
  const Result<RangeImage> image = RangeImage::make(arena);
  if (!image.ok()) return image.status();
  result.image_ = *image;
  return result;
}

void FreeSpace::begin(const FreeSpaceConfig& config, const Lattice& lattice,
                      const Point3d& origin_map) noexcept {
  config_ = config;
  resolution_m_ = lattice.resolution_m();
  origin_map_ = origin_map;
  index_.clear();
  count_ = 0;
  steps_ = 0;
  image_.clear();
}

void FreeSpace::forget_marks() noexcept {
  for (RayBlock& block : blocks()) block = RayBlock{.coord = block.coord};
  image_.clear();
}

RayBlock* FreeSpace::entry(BlockCoord coord) noexcept {
  const Result<BlockKey> key = pack(coord);
  if (!key.ok()) return nullptr;
  if (const auto found = index_.find(*key)) return &blocks_[*found];
  if (count_ == blocks_.size()) return nullptr;
  if (index_.insert(*key, static_cast<std::uint32_t>(count_)) != Status::kOk) return nullptr;
  blocks_[count_] = RayBlock{.coord = coord};
  return &blocks_[count_++];
}

void FreeSpace::add_return(const Point3f& p_map) noexcept {
  const Point3d d = p_map.cast<double>() - origin_map_;
  const double range_m = norm(d);
  if (range_m > 0.0) image_.add_return(d, range_m);
}

double FreeSpace::carve_length_m(const Point3d& d, double length_m, bool is_return) const noexcept {
  double nearest = is_return ? length_m : static_cast<double>(RangeImage::kNone_m);
  if (config_.neighbour_angle_rad > 0.0F) {
    const float neighbour_m = image_.nearest_m(d, config_.neighbour_angle_rad);
    nearest = std::min(nearest, static_cast<double>(neighbour_m));
  }
  nearest -= static_cast<double>(config_.margin_voxels) * resolution_m_;
  return nearest < length_m ? nearest : length_m;
}

std::uint64_t FreeSpace::most_steps(const Point3f& end_map) const noexcept {
  const Point3d d = end_map.cast<double>() - origin_map_;
  return static_cast<std::uint64_t>((std::abs(d.x()) + std::abs(d.y()) + std::abs(d.z())) /
                                    resolution_m_) +
         4;
}

Status FreeSpace::mark_hit(VoxelCoord voxel) noexcept {
  RayBlock* const block = entry(block_of(voxel));
  if (block == nullptr) return Status::kResourceExhausted;
  block->hit[static_cast<std::size_t>(voxel.z & 7)] |=
      std::uint64_t{1} << static_cast<unsigned>((voxel.y & 7) * 8 + (voxel.x & 7));
  return Status::kOk;
}

Result<std::span<const std::uint32_t>> FreeSpace::cross(const Point3f& end_map) noexcept {
  std::size_t crossed = 0;
  const RayBlock* last = nullptr;
  const bool all = walk_segment(origin_map_ / resolution_m_, end_map.cast<double>() / resolution_m_,
                                [&](int x, int y, int z, double) {
                                  ++steps_;
                                  const BlockCoord here = block_of({x, y, z});
                                  if (last != nullptr && last->coord == here) return true;
                                  last = entry(here);
                                  if (last == nullptr || crossed == crossed_.size()) return false;
                                  crossed_[crossed++] =
                                      static_cast<std::uint32_t>(last - blocks_.data());
                                  return true;
                                });
  if (!all) return Status::kResourceExhausted;
  return std::span<const std::uint32_t>(crossed_.first(crossed));
}

void FreeSpace::truncate(std::size_t count) noexcept {
  for (; count_ > count; --count_) {
    const bool erased = index_.erase(*pack(blocks_[count_ - 1].coord));
    TESSERA_ASSERT(erased);
    static_cast<void>(erased);
  }
}

Status FreeSpace::trace(const Point3f& end_map, bool is_return) noexcept {
  const Point3d d = end_map.cast<double>() - origin_map_;
  const double length_m = norm(d);
  if (!(length_m > 0.0)) return Status::kOk;
  const double carve_m = carve_length_m(d, length_m, is_return);
  if (carve_m <= 0.0) return Status::kOk;
  // The walk is the whole ray's, stopped early: what it visits is a prefix of what cross() visits,
  // to the bit.
  const double t_stop = carve_m / length_m;
  const Point3d end = end_map.cast<double>();
  RayBlock* block = nullptr;
  bool full = false;
  walk_segment(origin_map_ / resolution_m_, end / resolution_m_,
               [&](int x, int y, int z, double t) {
                 if (t >= t_stop) return false;
                 const BlockCoord here = block_of({x, y, z});
                 if (block == nullptr || !(block->coord == here)) {
                   block = entry(here);
                   full = block == nullptr;
                   if (full) return false;
                 }
                 block->passed[static_cast<std::size_t>(z & 7)] |=
                     std::uint64_t{1} << static_cast<unsigned>((y & 7) * 8 + (x & 7));
                 ++steps_;
                 return true;
               });
  return full ? Status::kResourceExhausted : Status::kOk;
}

}  // namespace tessera
