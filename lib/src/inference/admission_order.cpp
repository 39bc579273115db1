// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/admission_order.hpp"

#include <bit>

#include "tessera/inference/internal/scan_tiles.hpp"

namespace tessera {

namespace {

constexpr unsigned kUnitBits = 6;
constexpr unsigned kAxisBits =
    19;  // tiles of at least four voxels within 2^19 voxels on both sides

float square_to(const AdmissionScene& scene, const ScanPoint& point) noexcept {
  return static_cast<float>(squared_norm(point.p_map.cast<double>() - scene.origin_map));
}

/// The order of non-negative floats as integers.
std::uint64_t ordered_bits(float square) noexcept { return std::bit_cast<std::uint32_t>(square); }

/// Tile and unit, so that a tile's units are together.
std::uint64_t place_key(const AdmissionScene& scene, const BlockCoord& origin,
                        const ScanPoint& point) noexcept {
  const ScanTiles::Place place = ScanTiles::place_of(point.voxel, scene.unit_edge);
  const auto axis = [](std::int32_t tile, std::int32_t from) {
    const std::int32_t relative = tile - from + (1 << (kAxisBits - 1));
    TESSERA_ASSERT(relative >= 0 && relative < (1 << kAxisBits));
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(relative));
  };
  const std::uint64_t tile = axis(place.tile.x, origin.x) |
                             (axis(place.tile.y, origin.y) << kAxisBits) |
                             (axis(place.tile.z, origin.z) << (2 * kAxisBits));
  return (tile << kUnitBits) | static_cast<std::uint64_t>(place.unit);
}

/// Item numbers of the nearest point so far, in a tile or a unit.
struct Nearest {
  std::size_t item = 0;
  float square = 0.0F;
};

/// Replaces the keys of one tile's items, which are in order of units, by effective distances.
void rank_tile(const AdmissionScene& scene, std::span<KeyedIndex> tile) noexcept {
  Nearest in_tile;
  for (std::size_t begin = 0; begin < tile.size();) {
    const std::uint64_t unit = tile[begin].key;
    Nearest in_unit;
    std::size_t end = begin;
    for (; end < tile.size() && tile[end].key == unit; ++end) {
      const float square = square_to(scene, scene.points[tile[end].index]);
      if (end == begin || square < in_unit.square) in_unit = {end, square};
      tile[end].key = ordered_bits(square);
    }
    tile[in_unit.item].key = ordered_bits(in_unit.square / (kUnitLead * kUnitLead));
    if (begin == 0 || in_unit.square < in_tile.square) in_tile = in_unit;
    begin = end;
  }
  tile[in_tile.item].key = ordered_bits(in_tile.square / (kTileLead * kTileLead));
}

/// Effective distances for all points, tile by tile.
void rank_points(const AdmissionScene& scene, std::span<KeyedIndex> items,
                 std::span<KeyedIndex> scratch) noexcept {
  const BlockCoord origin = ScanTiles::place_of(scene.origin_voxel, scene.unit_edge).tile;
  for (std::size_t i = 0; i < items.size(); ++i)
    items[i] = {place_key(scene, origin, scene.points[i]), static_cast<std::uint32_t>(i)};
  radix_sort(items, scratch);
  for (std::size_t begin = 0; begin < items.size();) {
    const std::uint64_t tile = items[begin].key >> kUnitBits;
    std::size_t end = begin;
    while (end < items.size() && items[end].key >> kUnitBits == tile) ++end;
    rank_tile(scene, items.subspan(begin, end - begin));
    begin = end;
  }
}

}  // namespace

std::span<const KeyedIndex> order_of_admission(const AdmissionScene& scene,
                                               std::span<KeyedIndex> sort) noexcept {
  const std::size_t points = scene.points.size();
  const std::size_t n = points + scene.rays.size();
  TESSERA_ASSERT(sort.size() >= 2 * n);
  const std::span<KeyedIndex> items = sort.first(n);
  const std::span<KeyedIndex> scratch = sort.subspan(n);
  for (std::size_t i = 0; i < points && !scene.spread; ++i) {
    items[i] = {ordered_bits(square_to(scene, scene.points[i])), static_cast<std::uint32_t>(i)};
  }
  if (scene.spread) rank_points(scene, items.first(points), scratch);
  for (std::size_t i = points; i < n; ++i) {
    items[i] = {ordered_bits(square_to(scene, scene.rays[i - points])),
                static_cast<std::uint32_t>(i)};
  }
  radix_sort(items, scratch);
  return items;
}

}  // namespace tessera
