// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/scan_tiles.hpp"

#include <bit>

namespace tessera {

namespace {

/// q - corner as a float in the same voxel, which is at corner + voxel: rounding up onto the
/// voxel's far border would move the point to the next one.
float local_coordinate(double q, int corner, int voxel) noexcept {
  const auto rounded = static_cast<float>(q - static_cast<double>(corner));
  const bool moved = rounded >= static_cast<float>(voxel + 1);
  return moved ? std::bit_cast<float>(std::bit_cast<std::uint32_t>(rounded) - 1U) : rounded;
}

/// Gives a point of a tile the labels that are kept apart, and what they leave of one to rest.
void take_labels(const ScanPoint& point, const RestOfLabels& rest, TilePoint& into) noexcept {
  const std::uint32_t first = point.label_weights & 0xffU;
  const std::uint32_t second = (point.label_weights >> 8U) & 0xffU;
  const std::uint32_t third = point.label_weights >> 16U;
  std::uint32_t named = point.component;
  std::uint32_t weights = first;
  std::uint32_t left = kOneLabel - first;
  unsigned shift = 8;
  const auto keep = [&](std::uint8_t component, std::uint32_t weight) {
    if (weight == 0 || weight < rest.least_weight) return;
    named |= std::uint32_t{component} << shift;
    weights |= weight << shift;
    left -= weight;
    shift += 8;
  };
  keep(point.second, second);
  keep(point.third, third);
  if (left != 0) {
    named |= std::uint32_t{rest.component} << shift;
    weights |= left << shift;
  }
  into.second = static_cast<std::uint8_t>(named >> 8U);
  into.third = static_cast<std::uint8_t>(named >> 16U);
  into.fourth = static_cast<std::uint8_t>(named >> 24U);
  into.label_weights = weights;
}

VoxelCoord voxel_at(const Point3d& q) noexcept {
  return {floor_to_int(q.x()), floor_to_int(q.y()), floor_to_int(q.z())};
}

/// Keys that sort points by tile, in (z, y, x) order, then by unit.
class TileOrder {
 public:
  TileOrder(std::span<const ScanPoint> points, const Lattice& lattice, int unit_edge) noexcept
      : unit_edge_(unit_edge) {
    const auto [low, high] = bounds_of(points);
    // The tile of a coordinate never falls where the coordinate rises.
    corner_ = ScanTiles::place_of(voxel_at(lattice.to_voxels(low)), unit_edge).tile;
    const BlockCoord last = ScanTiles::place_of(voxel_at(lattice.to_voxels(high)), unit_edge).tile;
    const auto width = [](std::int32_t from, std::int32_t to) {
      return static_cast<unsigned>(
          std::bit_width(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from)));
    };
    y_shift_ = kUnitBits + width(corner_.x, last.x);
    z_shift_ = y_shift_ + width(corner_.y, last.y);
    TESSERA_ASSERT(z_shift_ + width(corner_.z, last.z) <= 64);
  }
  static constexpr unsigned kUnitBits = 6;

  [[nodiscard]] std::uint64_t key_of(const VoxelCoord& voxel) const noexcept {
    const ScanTiles::Place at = ScanTiles::place_of(voxel, unit_edge_);
    const auto relative = [](std::int32_t v, std::int32_t base) {
      return static_cast<std::uint64_t>(v - base);
    };
    return static_cast<std::uint64_t>(at.unit) | (relative(at.tile.x, corner_.x) << kUnitBits) |
           (relative(at.tile.y, corner_.y) << y_shift_) |
           (relative(at.tile.z, corner_.z) << z_shift_);
  }

 private:
  BlockCoord corner_{};
  unsigned y_shift_ = 0;
  unsigned z_shift_ = 0;
  int unit_edge_;
};

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

void ScanTiles::reset(int unit_edge, const RestOfLabels& rest) noexcept {
  unit_edge_ = unit_edge;
  rest_ = rest;
  index_.clear();
  tile_count_ = point_count_ = unit_count_ = 0;
}

void ScanTiles::forget_points() noexcept {
  for (Tile& tile : tiles()) tile = Tile{.coord = tile.coord};
  point_count_ = unit_count_ = 0;
}

void ScanTiles::truncate(std::size_t count) noexcept {
  for (; tile_count_ > count; --tile_count_) {
    const Tile& last = tiles_[tile_count_ - 1];
    for (std::size_t face = 0; face < last.beside.size(); ++face) {
      if (last.beside[face] != 0) tiles_[last.beside[face] - 1].beside[face ^ 1U] = 0;
    }
    const bool erased = index_.erase(*pack(last.coord));
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

Result<std::uint32_t> ScanTiles::link_beside(std::uint32_t number, std::size_t face) noexcept {
  const Result<std::uint32_t> beside = ensure(tiles_[number].coord + kFaceSteps[face]);
  if (!beside.ok()) return beside;
  tiles_[number].beside[face] = *beside + 1;
  tiles_[*beside].beside[face ^ 1U] = number + 1;
  return beside;
}

Status ScanTiles::build(std::span<const ScanPoint> points, const Lattice& lattice,
                        std::span<KeyedIndex> sort) noexcept {
  TESSERA_ASSERT(points.size() <= points_.size() && sort.size() >= 2 * points.size());
  TESSERA_ASSERT(point_count_ == 0);
  // Thinned by voxels, points come nearly always in order.
  const std::size_t tiles_before = tile_count_;
  const Status as_they_come =
      append(points.size(), lattice, [&](std::size_t i) -> const ScanPoint& { return points[i]; });
  if (as_they_come != Status::kInvalidArgument) return as_they_come;
  forget_points();
  truncate(tiles_before);
  const TileOrder order(points, lattice, unit_edge_);
  const std::span<KeyedIndex> items = sort.first(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    items[i] = {order.key_of(points[i].voxel), static_cast<std::uint32_t>(i)};
  radix_sort(items, sort.subspan(points.size()));
  const Status sorted = append(points.size(), lattice, [&](std::size_t i) -> const ScanPoint& {
    return points[items[i].index];
  });
  TESSERA_ASSERT(sorted != Status::kInvalidArgument);
  return sorted;
}

/// Fails with kInvalidArgument iff a point is not in order, kResourceExhausted as build; then some
/// of the points were appended.
template <class PointAt>
Status ScanTiles::append(std::size_t count, const Lattice& lattice, PointAt&& point_at) noexcept {
  const int edge = tile_edge();  // a power of two
  const auto is_in_tile = [edge](const VoxelCoord& v) {
    return static_cast<unsigned>(v.x | v.y | v.z) < static_cast<unsigned>(edge);
  };
  Tile* tile = nullptr;
  VoxelCoord corner;  // of the tile
  int unit = 0;
  UnitSample* sample = nullptr;  // of the unit
  for (std::size_t i = 0; i < count; ++i) {
    const ScanPoint& point = point_at(i);
    const VoxelCoord voxel = point.voxel;
    const bool new_tile = tile == nullptr || !is_in_tile(voxel - corner);
    if (new_tile) {
      const BlockCoord coord = place_of(voxel, unit_edge_).tile;
      if (tile != nullptr && pack_in_grid(coord) < pack_in_grid(tile->coord))
        return Status::kInvalidArgument;
      const Result<std::uint32_t> number = ensure(coord);
      if (!number.ok()) return Status::kResourceExhausted;
      tile = &tiles_[*number];
      tile->first_unit = static_cast<std::uint32_t>(unit_count_);
      corner = {coord.x * edge, coord.y * edge, coord.z * edge};
    }
    const VoxelCoord in_tile = voxel - corner;
    const int its_unit = place_of(in_tile, unit_edge_).unit;
    if (new_tile || its_unit != unit) {
      if (!new_tile && its_unit < unit) return Status::kInvalidArgument;
      unit = its_unit;
      tile->occupied |= unit_bit(unit);
      const auto begin = static_cast<std::uint32_t>(point_count_);
      sample = &units_[unit_count_++];
      *sample = {.begin = begin, .end = begin};
    }
    ++sample->end;
    const Point3d q = lattice.to_voxels(point.p_map);
    points_[point_count_++] = {.x = local_coordinate(q.x(), corner.x, in_tile.x),
                               .y = local_coordinate(q.y(), corner.y, in_tile.y),
                               .z = local_coordinate(q.z(), corner.z, in_tile.z),
                               .weight = point.weight,
                               .component = point.component};
    if (!point.has_one_label()) take_labels(point, rest_, points_[point_count_ - 1]);
  }
  return Status::kOk;
}

std::uint64_t box_mask(const std::array<int, 3>& low, const std::array<int, 3>& high) noexcept {
  std::array<unsigned, 3> from{};
  std::array<unsigned, 3> beyond{};  // units after the last
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (low[axis] > high[axis] || low[axis] > 3 || high[axis] < 0) return 0;
    from[axis] = low[axis] < 0 ? 0U : static_cast<unsigned>(low[axis]);
    beyond[axis] = high[axis] > 3 ? 0U : static_cast<unsigned>(3 - high[axis]);
  }
  const std::uint64_t row = (0xfULL >> beyond[0]) & (0xfULL << from[0]);
  const std::uint64_t slice = (0xffffULL >> (4 * beyond[1])) & (0xffffULL << (4 * from[1]));
  const std::uint64_t cube = (~0ULL >> (16 * beyond[2])) & (~0ULL << (16 * from[2]));
  return (row * 0x1111111111111111U) & (slice * 0x0001000100010001U) & cube;
}

}  // namespace tessera
