// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/free_space.hpp"

#include <cmath>

namespace tessera {

namespace {

/// sqrt is a basic IEEE operation: correctly rounded, so the same everywhere.
double length_of(const Point3d& v) noexcept { return std::sqrt(v.squaredNorm()); }

}  // namespace

Result<FreeSpace> FreeSpace::make(Arena& arena, const ScanCapacity& capacity) noexcept {
  if (arena.remaining_bytes() < required_bytes(capacity)) return Status::kResourceExhausted;
  FreeSpace result;
  const Result<KeyIndex> index = KeyIndex::make(arena, capacity.ray_blocks);
  if (!index.ok()) return index.status();
  result.index_ = *index;
  result.blocks_ = arena.take<RayBlock>(capacity.ray_blocks);
  result.image_ = arena.take<float>(kImagePixels);
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
  for (float& range_m : image_) range_m = 3.4e38F;
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

std::size_t FreeSpace::pixel_of(const Point3d& d) noexcept {
  const double ax = d.x() < 0 ? -d.x() : d.x();
  const double ay = d.y() < 0 ? -d.y() : d.y();
  const double az = d.z() < 0 ? -d.z() : d.z();
  std::size_t face = 0;
  double u = 0.0;
  double v = 0.0;
  if (ax >= ay && ax >= az) {
    face = d.x() < 0 ? 1 : 0;
    u = d.y() / ax;
    v = d.z() / ax;
  } else if (ay >= az) {
    face = d.y() < 0 ? 3 : 2;
    u = d.x() / ay;
    v = d.z() / ay;
  } else {
    face = d.z() < 0 ? 5 : 4;
    u = d.x() / az;
    v = d.y() / az;
  }
  const auto pixel = [](double w) {
    const int i = static_cast<int>((w + 1.0) * (0.5 * kFacePixels));
    return static_cast<std::size_t>(i < 0 ? 0 : (i >= kFacePixels ? kFacePixels - 1 : i));
  };
  return (face * kFacePixels + pixel(v)) * kFacePixels + pixel(u);
}

void FreeSpace::add_return(const Point3f& p_map) noexcept {
  const Point3d d = p_map.cast<double>() - origin_map_;
  const double range_m = length_of(d);
  if (!(range_m > 0.0)) return;
  float& nearest = image_[pixel_of(d)];
  if (static_cast<float>(range_m) < nearest) nearest = static_cast<float>(range_m);
}

double FreeSpace::carve_length_m(const Point3d& d, double length_m, bool is_return) const noexcept {
  double nearest = is_return ? length_m : 3.4e38;
  if (config_.neighbour_angle_rad > 0.0F) {
    const Point3d axis = std::abs(d.z()) < 0.9 * length_m ? Point3d(0, 0, 1) : Point3d(1, 0, 0);
    Point3d side = d.cross(axis);
    side *= length_m * static_cast<double>(config_.neighbour_angle_rad) / length_of(side);
    const Point3d up = side.cross(d) / length_m;
    for (int i = -1; i <= 1; ++i) {
      for (int j = -1; j <= 1; ++j) {
        const Point3d near = d + static_cast<double>(i) * side + static_cast<double>(j) * up;
        const auto range_m = static_cast<double>(image_[pixel_of(near)]);
        if (range_m < nearest) nearest = range_m;
      }
    }
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

Status FreeSpace::trace(const Point3f& end_map, bool is_return) noexcept {
  const Point3d d = end_map.cast<double>() - origin_map_;
  const double length_m = length_of(d);
  if (!(length_m > 0.0)) return Status::kOk;
  const double carve_m = carve_length_m(d, length_m, is_return);
  if (carve_m <= 0.0) return Status::kOk;
  // The walk is the whole ray's, stopped early: what it visits is a prefix of what for_each_block
  // visits, to the bit.
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
