// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One scan's points in order of space. A unit is a cube of 1, 2 or 4 voxels (the entropy block); a
// tile is 4 x 4 x 4 units, so that which units hold points is one 64-bit word and neighbourhoods
// are shifts. With the default unit of two voxels a tile is a block of the map.
#pragma once

#include <array>
#include <bit>
#include <span>

#include "tessera/base/internal/bits.hpp"
#include "tessera/base/internal/radix_sort.hpp"
#include "tessera/grid/internal/key_index.hpp"
#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/tile_point.hpp"
#include "tessera/map/map_config.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// The points of one unit, and what the entropies need to know of them.
struct UnitSample {
  /// Values of label that are no class.
  static constexpr std::uint8_t kNoLabel = 0;
  static constexpr std::uint8_t kMixed = 255;

  std::uint32_t begin = 0;  ///< Into ScanTiles::points().
  std::uint32_t end = 0;
  float class_entropy = 0.0F;  ///< E_c in [0, 1].
  std::uint8_t label =
      kNoLabel;  ///< The label that all labelled points share, kMixed, or kNoLabel.
};

/// A unit's place in a tile's masks.
[[nodiscard]] constexpr std::uint64_t unit_bit(int unit) noexcept {
  return std::uint64_t{1} << static_cast<unsigned>(unit);
}

/// 4 x 4 x 4 units of a scan.
struct Tile {
  BlockCoord coord;              ///< In units of tiles.
  std::uint8_t opened = 0;       ///< Which of the blocks were opened for it, a bit each.
  std::uint64_t occupied = 0;    ///< Units with points (unit_bit); unit x + 4 y + 16 z.
  std::uint64_t wanted = 0;      ///< Units that may receive evidence.
  std::uint64_t reserved = 0;    ///< Units reserved while points are admitted one by one.
  std::uint32_t first_unit = 0;  ///< Samples of the occupied units, in order of their bits.
  /// Kernel mode, where no point reaches beyond the next tile: those around this one, itself too,
  /// with points that reach it; bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1).
  std::uint32_t sources = 0;
  /// The map's blocks that the tile covers: one, or eight for units of four voxels (x fastest). 0:
  /// not open, or not looked for.
  std::array<SlabHandle, 8> blocks{};
  /// Numbers of the tiles at its faces (kFaceSteps), plus one; 0: none, or not linked
  /// (ScanTiles::ensure_beside).
  std::array<std::uint32_t, 6> beside{};
};

/// Where what points' labels leave of one goes, and which labels go there too: those that are not
/// the best and weigh less, in 255ths.
struct RestOfLabels {
  std::uint8_t component = 0;
  std::uint8_t least_weight = 0;
};

class ScanTiles {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ScanCapacity& capacity) noexcept {
    return KeyIndex::required_bytes(capacity.tiles) + arena_bytes<Tile>(capacity.tiles) +
           arena_bytes<TilePoint>(capacity.points) + arena_bytes<UnitSample>(capacity.points);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<ScanTiles> make(Arena& arena, const ScanCapacity& capacity) noexcept;
  ScanTiles() noexcept = default;

  /// Forgets the last scan; no tiles then, units of unit_edge voxels, and labels kept apart so far.
  /// O(capacity of tiles).
  void reset(int unit_edge, const RestOfLabels& rest = {}) noexcept;
  /// Forgets the points and all masks; the tiles stay, so that ensure() of the same ones cannot
  /// fail. O(tiles).
  void forget_points() noexcept;
  /// Takes back the tiles made last, down to count, and the links to them. O(tiles taken back).
  void truncate(std::size_t count) noexcept;
  /// Sorts points (in the grid) into tiles and units, which must hold no points yet. sort: at least
  /// 2 * points.size(). Fails with kResourceExhausted iff there are more tiles than capacity or the
  /// index has no place for one; only reset() is of use then. O(n).
  Status build(std::span<const ScanPoint> points, const Lattice& lattice,
               std::span<KeyedIndex> sort) noexcept;
  /// The tile at coord, made empty if absent. Fails with kResourceExhausted iff the tiles or their
  /// index are full, kOutOfRange iff coord is outside the grid.
  [[nodiscard]] Result<std::uint32_t> ensure(BlockCoord coord) noexcept;
  [[nodiscard]] Tile* find(BlockCoord coord) noexcept;
  [[nodiscard]] const Tile* find(BlockCoord coord) const noexcept;

  /// The tile at a face of that with this number, made empty if absent; both are linked then, until
  /// the points are forgotten or one is taken back. Fails as ensure.
  [[nodiscard]] Result<std::uint32_t> ensure_beside(std::uint32_t number,
                                                    std::size_t face) noexcept {
    const std::uint32_t linked = tiles_[number].beside[face];
    return linked != 0 ? Result<std::uint32_t>(linked - 1) : link_beside(number, face);
  }
  /// The tile linked at a face of this one, or null.
  [[nodiscard]] const Tile* beside(const Tile& tile, std::size_t face) const noexcept {
    const std::uint32_t number = tile.beside[face];
    return number == 0 ? nullptr : &tiles_[number - 1];
  }
  /// The tile so many steps along an axis, or null where one of the steps has no link.
  [[nodiscard]] const Tile* stepped(const Tile* tile, std::size_t axis, int steps) const noexcept {
    const std::size_t face = 2 * axis + (steps > 0 ? 1 : 0);
    for (int left = steps > 0 ? steps : -steps; left > 0 && tile != nullptr; --left)
      tile = beside(*tile, face);
    return tile;
  }

  /// Its units want nothing more. O(1).
  void mark_written(const Tile& tile) noexcept {
    tiles_[static_cast<std::size_t>(&tile - tiles_.data())].wanted = 0;
  }
  [[nodiscard]] std::span<Tile> tiles() noexcept { return tiles_.first(tile_count_); }
  [[nodiscard]] std::span<const Tile> tiles() const noexcept { return tiles_.first(tile_count_); }
  [[nodiscard]] std::span<const TilePoint> points() const noexcept {
    return points_.first(point_count_);
  }
  [[nodiscard]] std::span<UnitSample> units() noexcept { return units_.first(unit_count_); }
  /// The sample of an occupied unit.
  [[nodiscard]] const UnitSample& sample(const Tile& tile, int unit) const noexcept {
    const std::uint64_t below = tile.occupied & (unit_bit(unit) - 1);
    return units_[tile.first_unit + static_cast<std::size_t>(count_ones(below))];
  }
  [[nodiscard]] int unit_edge() const noexcept { return unit_edge_; }
  [[nodiscard]] int tile_edge() const noexcept { return 4 * unit_edge_; }

  /// The tile and unit of a voxel.
  struct Place {
    BlockCoord tile;
    int unit = 0;
  };
  [[nodiscard]] static constexpr Place place_of(VoxelCoord v, int unit_edge) noexcept {
    const int shift = unit_edge == 1 ? 0 : (unit_edge == 2 ? 1 : 2);
    const VoxelCoord u{v.x >> shift, v.y >> shift, v.z >> shift};
    return {{u.x >> 2, u.y >> 2, u.z >> 2}, (u.x & 3) | ((u.y & 3) << 2) | ((u.z & 3) << 4)};
  }

 private:
  /// Appends points, which come by tiles in (z, y, x) order, then by units.
  template <class PointAt>
  Status append(std::size_t count, const Lattice& lattice, PointAt&& point_at) noexcept;
  [[nodiscard]] Result<std::uint32_t> link_beside(std::uint32_t number, std::size_t face) noexcept;

  KeyIndex index_{};
  std::span<Tile> tiles_;
  std::span<TilePoint> points_;
  std::span<UnitSample> units_;
  std::size_t tile_count_ = 0;
  std::size_t point_count_ = 0;
  std::size_t unit_count_ = 0;
  int unit_edge_ = 2;
  RestOfLabels rest_{};
};

/// The 64-bit mask of the units x0..x1, y0..y1, z0..z1 of a tile, bounds clipped to 0 .. 3; empty
/// if any is reversed.
[[nodiscard]] std::uint64_t box_mask(const std::array<int, 3>& low,
                                     const std::array<int, 3>& high) noexcept;

/// For each unit of a tile with mask own, whether its neighbour in each of the directions -x +x -y
/// +y -z +z is set; faces: the masks of the six face-neighbour tiles in that order.
[[nodiscard]] constexpr std::array<std::uint64_t, 6> neighbour_masks(
    std::uint64_t own, const std::array<std::uint64_t, 6>& faces) noexcept {
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

/// The units within reach of some units of a tile along one axis: of that tile, and of those next
/// to it below and above. Those k tiles farther are what is next with a reach 4 k units shorter.
struct UnitsAlong {
  std::uint64_t below = 0;
  std::uint64_t own = 0;
  std::uint64_t above = 0;
};
/// reach: in units; below 1: the units themselves. O(reach), at most 7 steps.
template <std::size_t kAxis>
[[nodiscard]] constexpr UnitsAlong units_along(std::uint64_t units, int reach) noexcept {
  constexpr std::array<std::uint64_t, 3> kFirsts{0x1111111111111111U, 0x000f000f000f000fU,
                                                 0x000000000000ffffU};
  constexpr unsigned kStep = 1U << (2 * kAxis);
  constexpr std::uint64_t kFirst = kFirsts[kAxis];
  constexpr std::uint64_t kLast = kFirst << (3 * kStep);
  const auto up = [](std::uint64_t mask) { return (mask & ~kLast) << kStep; };
  const auto down = [](std::uint64_t mask) { return (mask & ~kFirst) >> kStep; };
  UnitsAlong along{.own = units};
  for (int left = reach < 7 ? reach : 7; left > 0; --left) {
    along.below |= down(along.below) | ((along.own & kFirst) << (3 * kStep));
    along.above |= up(along.above) | ((along.own & kLast) >> (3 * kStep));
    along.own |= up(along.own) | down(along.own);
  }
  return along;
}

/// Units in which at least least of the six masks are set. least in 1 .. 7.
[[nodiscard]] constexpr std::uint64_t at_least(const std::array<std::uint64_t, 6>& masks,
                                               int least) noexcept {
  // Counters of 64 units at once: bit i of ones, twos and fours is unit i's count.
  std::uint64_t ones = 0;
  std::uint64_t twos = 0;
  std::uint64_t fours = 0;
  for (const std::uint64_t mask : masks) {
    const std::uint64_t carry_one = ones & mask;
    ones ^= mask;
    fours |= twos & carry_one;
    twos ^= carry_one;
  }
  switch (least) {
    case 1:
      return ones | twos | fours;
    case 2:
      return twos | fours;
    case 3:
      return (ones & twos) | fours;
    case 4:
      return fours;
    case 5:
      return (ones | twos) & fours;
    case 6:
      return twos & fours;
    default:
      return 0;
  }
}

}  // namespace tessera
