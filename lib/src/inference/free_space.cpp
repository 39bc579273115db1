// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/free_space.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace tessera {

namespace {

/// Exchanges rows and columns of the 8 x 8 bytes that eight words are.
void transpose_bytes(VoxelMask& words) noexcept {
  for (unsigned half = 4; half > 0; half /= 2) {
    // Bytes whose index has the bit `half`, of words that have it not, against the others'.
    const std::uint64_t low = half == 4   ? 0x00000000ffffffffU
                              : half == 2 ? 0x0000ffff0000ffffU
                                          : 0x00ff00ff00ff00ffU;
    const unsigned shift = 8 * half;
    for (std::size_t i = 0; i < words.size(); ++i) {
      if ((i & half) != 0) continue;
      const std::uint64_t a = words[i];
      const std::uint64_t b = words[i + half];
      words[i] = (a & low) | ((b & low) << shift);
      words[i + half] = ((a >> shift) & low) | (b & ~low);
    }
  }
}

/// Exchanges rows and columns of the 8 x 8 bits that a word is.
constexpr std::uint64_t transpose_bits(std::uint64_t word) noexcept {
  std::uint64_t t = (word ^ (word >> 7U)) & 0x00aa00aa00aa00aaU;
  word ^= t ^ (t << 7U);
  t = (word ^ (word >> 14U)) & 0x0000cccc0000ccccU;
  word ^= t ^ (t << 14U);
  t = (word ^ (word >> 28U)) & 0x00000000f0f0f0f0U;
  return word ^ t ^ (t << 28U);
}

}  // namespace

void RayBlock::turn(int axis) noexcept {
  if (axis == words_along) return;
  std::uint64_t any = 0;
  for (const std::uint64_t word : passed) any |= word;
  if (any != 0) {
    // By way of words along z, bytes along y and bits along x.
    if (words_along != 2) transpose_bytes(passed);
    if (words_along == 0) {
      for (std::uint64_t& word : passed) word = transpose_bits(word);
    }
    if (axis == 0) {
      for (std::uint64_t& word : passed) word = transpose_bits(word);
    }
    if (axis != 2) transpose_bytes(passed);
  }
  words_along = static_cast<std::uint8_t>(axis);
}

Result<FreeSpace> FreeSpace::make(Arena& arena, const ScanCapacity& capacity,
                                  Carving carving) noexcept {
  if (arena.remaining_bytes() < required_bytes(capacity, carving))
    return Status::kResourceExhausted;
  FreeSpace result;
  const Result<KeyIndex> index = KeyIndex::make(arena, capacity.ray_blocks);
  if (!index.ok()) return index.status();
  result.index_ = *index;
  result.blocks_ = arena.take<RayBlock>(capacity.ray_blocks);
  result.recent_ = arena.take<std::uint32_t>(kRecent);
  if (carving != Carving::kRays) return result;
  result.crossed_ = arena.take<std::uint32_t>(capacity.ray_blocks + std::size_t{1});
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

RayBlock* FreeSpace::find_entry(BlockCoord coord) noexcept {
  const Result<BlockKey> key = pack(coord);
  if (!key.ok()) return nullptr;
  const std::optional<std::uint32_t> found = index_.find(*key);
  RayBlock* const block = found ? &blocks_[*found] : new_entry(coord);
  if (block != nullptr)
    recent_[recent_slot(coord)] = static_cast<std::uint32_t>(block - blocks_.data());
  return block;
}

RayBlock* FreeSpace::new_entry(BlockCoord coord) noexcept {
  if (count_ == blocks_.size()) return nullptr;
  if (index_.insert(*pack(coord), static_cast<std::uint32_t>(count_)) != Status::kOk)
    return nullptr;
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

Status FreeSpace::mark_hit(const VoxelCoord& voxel) noexcept {
  RayBlock* const block = entry(block_of(voxel));
  if (block == nullptr) return Status::kResourceExhausted;
  mark_hit(*block, voxel);
  return Status::kOk;
}

void FreeSpace::mark_hit(RayBlock& block, const VoxelCoord& voxel) noexcept {
  block.hit[static_cast<std::size_t>(voxel.z & 7)] |=
      std::uint64_t{1} << static_cast<unsigned>((voxel.y & 7) * 8 + (voxel.x & 7));
}

/// Points of a block mostly follow each other.
void FreeSpace::mark_hits(std::span<const ScanPoint> returns) noexcept {
  if (returns.empty()) return;
  BlockCoord last = block_of(returns.front().voxel);
  RayBlock* block = held(last);
  for (const ScanPoint& point : returns) {
    const BlockCoord coord = block_of(point.voxel);
    if (!(coord == last)) block = held(coord);
    last = coord;
    if (block != nullptr) mark_hit(*block, point.voxel);
  }
}

RayBlock* FreeSpace::held(BlockCoord coord) noexcept {
  std::uint32_t& recent = recent_[recent_slot(coord)];
  if (recent < count_ && blocks_[recent].coord == coord) return &blocks_[recent];
  const std::optional<std::uint32_t> found = index_.find(pack_in_grid(coord));
  if (!found) return nullptr;
  recent = *found;
  return &blocks_[*found];
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
  // A part of the whole ray's walk: what it marks is among what cross() visits, to the bit.
  const SlabWalk walk = walk_to(end_map, carve_m / length_m);
  steps_ += walk.voxels();
  const bool all = walk.walk<false>(
      [this, &walk](BlockCoord coord) -> std::uint64_t* { return words_of(coord, walk.axis()); });
  return all ? Status::kOk : Status::kResourceExhausted;
}

Status FreeSpace::add_returns(std::span<const ScanPoint> returns) noexcept {
  for (const ScanPoint& point : returns) {
    add_return(point.p_map);
    if (mark_hit(point.voxel) != Status::kOk) return Status::kResourceExhausted;
  }
  return Status::kOk;
}

int FreeSpace::axis_of(const Point3f& end_map) const noexcept {
  return SlabWalk::longest_axis(end_map.cast<double>() - origin_map_);
}

void FreeSpace::finish() noexcept {
  for (RayBlock& block : blocks()) block.turn(2);
}

}  // namespace tessera
