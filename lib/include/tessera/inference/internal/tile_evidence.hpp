// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sums of eq. 7 for the octets of a tile (the kernel mode's: kernel_strip.hpp). Every function
// adds up in a fixed order (tiles by offset, points as sorted), so the same scan gives the same
// bits.
#pragma once

#include <array>
#include <limits>
#include <span>

#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/entropy.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"
#include "tessera/semantics/evidence.hpp"

namespace tessera {

struct OctetPoints;
using AddOctetPoints = std::uint64_t (*)(OctetPoints& octet) noexcept;

/// What evidence took.
struct EvidenceWork {
  std::uint64_t updates = 0;      ///< Contributions added.
  std::uint64_t evaluations = 0;  ///< Kernel evaluations.
};

/// A kernel of one length, ready for sums in units of voxels.
struct KernelShape {
  float inverse_square = 0.0F;  ///< 1 / D^2, D in voxels.
  float scale = 1.0F;           ///< eps_0.
  float min_weight = 0.0F;
};
/// The least contribution that counts: a min_weight of zero lets pass what is a count at all.
[[nodiscard]] constexpr float least_counted(float min_weight) noexcept {
  return min_weight > kLeastCount ? min_weight : kLeastCount;
}

/// The octets of a unit: where each begins in its tile (voxels, even), and which of its voxels
/// belong to the unit.
struct OctetPlace {
  std::array<std::int8_t, 3> corner{};  ///< Tile-local voxel coordinates.
  std::uint8_t voxels = 0xff;
};
/// The octets that a unit covers.
struct UnitOctets {
  std::array<OctetPlace, 8> place{};
  int count = 1;  ///< One, or eight for units of four voxels.

  [[nodiscard]] std::span<const OctetPlace> places() const noexcept {
    return {place.data(), static_cast<std::size_t>(count)};
  }
};
/// The octet that a unit of two voxels is.
[[nodiscard]] constexpr OctetPlace octet_of_unit(int unit) noexcept {
  return {.corner = {static_cast<std::int8_t>(2 * (unit & 3)),
                     static_cast<std::int8_t>(2 * ((unit >> 2) & 3)),
                     static_cast<std::int8_t>(2 * (unit >> 4))}};
}
[[nodiscard]] inline UnitOctets octets_of_unit(int unit, int unit_edge) noexcept {
  const auto place = [](int x, int y, int z, unsigned voxels) {
    return OctetPlace{.corner = {static_cast<std::int8_t>(x), static_cast<std::int8_t>(y),
                                 static_cast<std::int8_t>(z)},
                      .voxels = static_cast<std::uint8_t>(voxels)};
  };
  UnitOctets octets;
  const int x = (unit & 3) * unit_edge;
  const int y = ((unit >> 2) & 3) * unit_edge;
  const int z = (unit >> 4) * unit_edge;
  if (unit_edge == 2) {
    octets.place[0] = octet_of_unit(unit);
  } else if (unit_edge == 1) {
    // A tile of four voxels starts at an even voxel of the map, so parity in the tile is parity in
    // the map.
    const int voxel = (x & 1) | ((y & 1) << 1) | ((z & 1) << 2);
    octets.place[0] = place(x & ~1, y & ~1, z & ~1, 1U << static_cast<unsigned>(voxel));
  } else {
    for (int i = 0; i < 8; ++i)
      octets.place[static_cast<std::size_t>(i)] =
          place(x + 2 * (i & 1), y + 2 * ((i >> 1) & 1), z + 2 * (i >> 2), 0xffU);
    octets.count = 8;
  }
  return octets;
}

/// Which of a tile's blocks an octet lies in (Tile::blocks), and which octet of that block it is.
struct BlockOctet {
  int block = 0;
  int octet = 0;
};
[[nodiscard]] inline BlockOctet locate(const Tile& tile, const OctetPlace& octet,
                                       int unit_edge) noexcept {
  std::array<int, 3> c{octet.corner[0], octet.corner[1], octet.corner[2]};
  if (unit_edge == 1)
    c = {c[0] + 4 * (tile.coord.x & 1), c[1] + 4 * (tile.coord.y & 1),
         c[2] + 4 * (tile.coord.z & 1)};
  const auto octet_axis = [&](std::size_t axis) { return (c[axis] & 7) >> 1; };
  return {.block = (c[0] >> 3) | ((c[1] >> 3) << 1) | ((c[2] >> 3) << 2),
          .octet = octet_axis(0) | (octet_axis(1) << 2) | (octet_axis(2) << 4)};
}
/// How many of the map's blocks a tile covers, in part or whole.
[[nodiscard]] constexpr int blocks_of_tile(int unit_edge) noexcept {
  return unit_edge == 4 ? 8 : 1;
}
/// The coordinates of block number i of a tile.
[[nodiscard]] BlockCoord block_of_tile(const BlockCoord& tile, int unit_edge, int i) noexcept;

/// The units of a tile that lie in its block number i.
[[nodiscard]] constexpr std::uint64_t units_of_block(int unit_edge, int i) noexcept {
  // Units 0 and 1 of each axis are in the first of two blocks.
  return unit_edge == 4 ? std::uint64_t{0x0000000000330033}
                              << (2 * (i & 1) + 8 * ((i >> 1) & 1) + 32 * (i >> 2))
                        : ~std::uint64_t{0};
}

/// Calls visit(tile coordinates, mask of units) for every tile that holds a unit within reach units
/// of this one on every axis; visit returns false to stop, and false is then returned. The units of
/// all masks together are the whole cube.
template <class Visit>
bool for_units_around(const BlockCoord& tile, int unit, int reach, Visit&& visit) noexcept {
  const std::array<int, 3> at{tile.x * 4 + (unit & 3), tile.y * 4 + ((unit >> 2) & 3),
                              tile.z * 4 + (unit >> 4)};
  for (int tz = (at[2] - reach) >> 2; tz <= (at[2] + reach) >> 2; ++tz) {
    for (int ty = (at[1] - reach) >> 2; ty <= (at[1] + reach) >> 2; ++ty) {
      for (int tx = (at[0] - reach) >> 2; tx <= (at[0] + reach) >> 2; ++tx) {
        const std::uint64_t box =
            box_mask({at[0] - reach - 4 * tx, at[1] - reach - 4 * ty, at[2] - reach - 4 * tz},
                     {at[0] + reach - 4 * tx, at[1] + reach - 4 * ty, at[2] + reach - 4 * tz});
        if (!visit(BlockCoord{tx, ty, tz}, box)) return false;
      }
    }
  }
  return true;
}

/// The same for this unit and its six face neighbours.
template <class Visit>
bool for_units_across(const BlockCoord& tile, int unit, Visit&& visit) noexcept {
  const std::uint64_t bit = unit_bit(unit);
  std::uint64_t here = bit;
  for (const std::uint64_t neighbours : neighbour_masks(bit, {})) here |= neighbours;
  if (!visit(tile, here)) return false;
  const std::array<std::uint64_t, 6> spill = neighbour_masks(0, {bit, bit, bit, bit, bit, bit});
  for (std::size_t face = 0; face < 6; ++face) {
    const std::uint64_t beside =
        spill[face ^ 1U];  // units of the tile at that face that see this one
    if (beside != 0 && !visit(tile + kFaceSteps[face], beside)) return false;
  }
  return true;
}

/// Adds to each voxel of the octet the kernel-weighted points; shift is added to their coordinates.
/// wide: octet_points_by_eights(), or null; the bits are the same. O(8 points).
void add_points(std::span<const TilePoint> points, const Point3f& shift, const OctetPlace& octet,
                const KernelShape& kernel, AddOctetPoints wide, OctetEvidence& into,
                EvidenceWork& work) noexcept;
/// What wide lanes need for that; the sums of an octet may be of several calls.
[[nodiscard]] OctetPoints octet_points(const OctetPlace& octet, const KernelShape& kernel,
                                       OctetEvidence& into) noexcept;
/// The same with what octet_points() gave, and with into.set_touched() after the last call.
void add_points(std::span<const TilePoint> points, const Point3f& shift, const OctetPlace& octet,
                AddOctetPoints wide, OctetPoints& all, EvidenceWork& work) noexcept;
/// Of the widest lanes that this machine has.
[[nodiscard]] AddOctetPoints widest_octet_points() noexcept;

/// The means of the points in each voxel of the octet. O(points).
[[nodiscard]] OctetCentroids centroids_of(std::span<const TilePoint> points,
                                          const OctetPlace& octet) noexcept;

/// Adds each point's weight to its own voxel, unless it is under min_weight.
void count_points(std::span<const TilePoint> points, const OctetPlace& octet, float min_weight,
                  OctetEvidence& into, EvidenceWork& work) noexcept;

}  // namespace tessera
