// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/scan_tiles.hpp"

#include <bit>

namespace tessera {

namespace {

/// q - corner as a float in the same voxel: rounding up onto a voxel's far border would move the
/// point to the next one.
float local_coordinate(double q, double corner) noexcept {
  const double exact = q - corner;
  const auto rounded = static_cast<float>(exact);
  const bool moved = floor_to_int(static_cast<double>(rounded)) != floor_to_int(exact);
  return moved ? std::bit_cast<float>(std::bit_cast<std::uint32_t>(rounded) - 1U) : rounded;
}

}  // namespace

Result<ScanTiles> ScanTiles::make(Arena& arena, const ScanCapacity& capacity) noexcept {
  if (arena.remaining_bytes() < required_bytes(capacity)) return Status::kResourceExhausted;
  ScanTiles result;
  const Result<KeyIndex> index = KeyIndex::make(arena, capacity.tiles);
  if (!index.ok()) return index.status();
  result.index_ = *index;
  result.tiles_ = arena.take<Tile>(capacity.tiles);
  result.points_ = arena.take<TilePoint>(capacity.points);
  result.units_ = arena.take<UnitSample>(capacity.points);
  return result;
}

void ScanTiles::reset(int unit_edge) noexcept {
  unit_edge_ = unit_edge;
  index_.clear();
  tile_count_ = point_count_ = unit_count_ = 0;
}

void ScanTiles::forget_points() noexcept {
  for (Tile& tile : tiles()) tile = Tile{.coord = tile.coord};
  point_count_ = unit_count_ = 0;
}

void ScanTiles::truncate(std::size_t count) noexcept {
  for (; tile_count_ > count; --tile_count_) {
    const bool erased = index_.erase(*pack(tiles_[tile_count_ - 1].coord));
    TESSERA_ASSERT(erased);
    static_cast<void>(erased);
  }
}

Result<std::uint32_t> ScanTiles::ensure(BlockCoord coord) noexcept {
  const Result<BlockKey> key = pack(coord);
  if (!key.ok()) return key.status();
  if (const auto found = index_.find(*key)) return *found;
  if (tile_count_ == tiles_.size()) return Status::kResourceExhausted;
  const auto number = static_cast<std::uint32_t>(tile_count_);
  const Status status = index_.insert(*key, number);
  if (status != Status::kOk) return status;
  tiles_[tile_count_++] = Tile{.coord = coord};
  return number;
}

Tile* ScanTiles::find(BlockCoord coord) noexcept {
  const Result<BlockKey> key = pack(coord);
  if (!key.ok()) return nullptr;
  const auto found = index_.find(*key);
  return found ? &tiles_[*found] : nullptr;
}

const Tile* ScanTiles::find(BlockCoord coord) const noexcept {
  const Result<BlockKey> key = pack(coord);
  if (!key.ok()) return nullptr;
  const auto found = index_.find(*key);
  return found ? &tiles_[*found] : nullptr;
}

Status ScanTiles::build(std::span<const ScanPoint> points, const Lattice& lattice,
                        std::span<KeyedIndex> sort) noexcept {
  TESSERA_ASSERT(points.size() <= points_.size() && sort.size() >= 2 * points.size());
  TESSERA_ASSERT(point_count_ == 0);
  if (points.empty()) return Status::kOk;
  const auto place = [&](const ScanPoint& point) {
    return place_of(*lattice.voxel_of(point.p_map), unit_edge_);
  };
  BlockCoord low = place(points[0]).tile;
  BlockCoord high = low;
  for (const ScanPoint& point : points) {
    const BlockCoord tile = place(point).tile;
    low = {tile.x < low.x ? tile.x : low.x, tile.y < low.y ? tile.y : low.y,
           tile.z < low.z ? tile.z : low.z};
    high = {tile.x > high.x ? tile.x : high.x, tile.y > high.y ? tile.y : high.y,
            tile.z > high.z ? tile.z : high.z};
  }
  const auto width = [](std::int32_t from, std::int32_t to) {
    return static_cast<unsigned>(
        std::bit_width(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from)));
  };
  const unsigned x_shift = 6;
  const unsigned y_shift = x_shift + width(low.x, high.x);
  const unsigned z_shift = y_shift + width(low.y, high.y);
  TESSERA_ASSERT(z_shift + width(low.z, high.z) <= 64);
  const std::span<KeyedIndex> items = sort.first(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Place at = place(points[i]);
    const auto relative = [](std::int32_t v, std::int32_t base) {
      return static_cast<std::uint64_t>(v - base);
    };
    items[i] = {static_cast<std::uint64_t>(at.unit) | (relative(at.tile.x, low.x) << x_shift) |
                    (relative(at.tile.y, low.y) << y_shift) |
                    (relative(at.tile.z, low.z) << z_shift),
                static_cast<std::uint32_t>(i)};
  }
  radix_sort(items, sort.subspan(points.size()));

  const double edge = tile_edge();
  std::uint64_t current_key = ~std::uint64_t{0};
  Tile* current = nullptr;
  for (std::size_t first = 0; first < items.size();) {
    const std::uint64_t key = items[first].key;
    const Place at = place(points[items[first].index]);
    if ((key >> x_shift) != current_key) {
      current_key = key >> x_shift;
      const Result<std::uint32_t> tile = ensure(at.tile);
      if (!tile.ok()) return Status::kResourceExhausted;
      current = &tiles_[*tile];
      current->first_unit = static_cast<std::uint32_t>(unit_count_);
    }
    const auto begin = static_cast<std::uint32_t>(point_count_);
    std::size_t end = first;
    for (; end < items.size() && items[end].key == key; ++end) {
      const ScanPoint& point = points[items[end].index];
      const Point3d q = lattice.to_voxels(point.p_map);
      points_[point_count_++] = {.x = local_coordinate(q.x(), at.tile.x * edge),
                                 .y = local_coordinate(q.y(), at.tile.y * edge),
                                 .z = local_coordinate(q.z(), at.tile.z * edge),
                                 .weight = point.weight,
                                 .component = point.component};
    }
    current->occupied |= std::uint64_t{1} << static_cast<unsigned>(at.unit);
    units_[unit_count_++] = {.begin = begin, .end = static_cast<std::uint32_t>(point_count_)};
    first = end;
  }
  return Status::kOk;
}

std::uint64_t box_mask(const std::array<int, 3>& low, const std::array<int, 3>& high) noexcept {
  constexpr std::array<std::uint64_t, 3> kUnitAxis{0x1111111111111111U, 0x000f000f000f000fU,
                                                   0x000000000000ffffU};
  constexpr std::array<unsigned, 3> kStep{1, 4, 16};
  std::uint64_t mask = ~std::uint64_t{0};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int from = low[axis] < 0 ? 0 : low[axis];
    const int to = high[axis] > 3 ? 3 : high[axis];
    std::uint64_t slabs = 0;
    for (int i = from; i <= to; ++i)
      slabs |= kUnitAxis[axis] << (kStep[axis] * static_cast<unsigned>(i));
    mask &= slabs;
  }
  return mask;
}

std::array<std::uint64_t, 6> neighbour_masks(std::uint64_t own,
                                             const std::array<std::uint64_t, 6>& faces) noexcept {
  constexpr std::uint64_t kX0 = 0x1111111111111111U;
  constexpr std::uint64_t kX3 = 0x8888888888888888U;
  constexpr std::uint64_t kY0 = 0x000f000f000f000fU;
  constexpr std::uint64_t kY3 = 0xf000f000f000f000U;
  return {((own << 1U) & ~kX0) | ((faces[0] >> 3U) & kX0),
          ((own >> 1U) & ~kX3) | ((faces[1] << 3U) & kX3),
          ((own << 4U) & ~kY0) | ((faces[2] >> 12U) & kY0),
          ((own >> 4U) & ~kY3) | ((faces[3] << 12U) & kY3),
          (own << 16U) | (faces[4] >> 48U),
          (own >> 16U) | (faces[5] << 48U)};
}

std::uint64_t at_least(const std::array<std::uint64_t, 6>& masks, int least) noexcept {
  // Counters of 64 units at once: bit i of ones, twos and fours is unit i's count.
  std::uint64_t ones = 0;
  std::uint64_t twos = 0;
  std::uint64_t fours = 0;
  for (const std::uint64_t mask : masks) {
    const std::uint64_t carry_one = ones & mask;
    ones ^= mask;
    const std::uint64_t carry_two = twos & carry_one;
    twos ^= carry_one;
    fours |= carry_two;
  }
  std::uint64_t reached = 0;
  for (int count = least; count <= 6; ++count) {
    const auto digit = [count](unsigned bit, std::uint64_t set) {
      return ((static_cast<unsigned>(count) >> bit) & 1U) != 0 ? set : ~set;
    };
    reached |= digit(0, ones) & digit(1, twos) & digit(2, fours);
  }
  return reached;
}

}  // namespace tessera
