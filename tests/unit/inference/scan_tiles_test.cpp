// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Tiles, units and their neighbourhoods, against plain loops.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/random.hpp"
#include "tessera/inference/internal/tile_evidence.hpp"

namespace tessera {
namespace {

using oracle::Random;

bool has(std::uint64_t mask, int x, int y, int z) {
  return ((mask >> static_cast<unsigned>(x + 4 * y + 16 * z)) & 1U) != 0;
}

/// Whether unit (x, y, z), up to one step outside the tile on one axis, is set.
bool is_set(std::uint64_t own, const std::array<std::uint64_t, 6>& faces, int x, int y, int z) {
  if (x < 0) return has(faces[0], 3, y, z);
  if (x > 3) return has(faces[1], 0, y, z);
  if (y < 0) return has(faces[2], x, 3, z);
  if (y > 3) return has(faces[3], x, 0, z);
  if (z < 0) return has(faces[4], x, y, 3);
  if (z > 3) return has(faces[5], x, y, 0);
  return has(own, x, y, z);
}

constexpr std::array<std::array<int, 3>, 6> kSteps{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

/// A mask with about a quarter, half or three quarters of its bits set.
std::uint64_t random_mask(Random& random) {
  const int density = random.below(3);
  const std::uint64_t a = random.bits();
  const std::uint64_t b = random.bits();
  return density == 0 ? a & b : (density == 1 ? a : a | b);
}

int floor_divide(int a, int b) { return static_cast<int>(std::floor(static_cast<double>(a) / b)); }

}  // namespace

TEST_CASE("neighbour masks: each direction is the neighbour's bit, across tiles too") {
  Random random(71);
  std::size_t wrong = 0;
  for (int round = 0; round < 300; ++round) {
    const std::uint64_t own = random_mask(random);
    std::array<std::uint64_t, 6> faces{};
    for (std::uint64_t& face : faces) face = random_mask(random);
    const std::array<std::uint64_t, 6> masks = neighbour_masks(own, faces);
    for (int unit = 0; unit < 64; ++unit) {
      const std::array<int, 3> at{unit & 3, (unit >> 2) & 3, unit >> 4};
      for (std::size_t d = 0; d < 6; ++d) {
        const bool expected =
            is_set(own, faces, at[0] + kSteps[d][0], at[1] + kSteps[d][1], at[2] + kSteps[d][2]);
        if (has(masks[d], at[0], at[1], at[2]) != expected) ++wrong;
      }
    }
  }
  CHECK(wrong == 0);
}

namespace {

/// Units that units_along leaves out or adds, against all pairs of units on a line of tiles.
template <std::size_t kAxis>
std::size_t wrong_along(std::uint64_t units, int reach) {
  const UnitsAlong along = units_along<kAxis>(units, reach);
  const std::array<std::uint64_t, 3> tiles{along.below, along.own, along.above};
  std::size_t wrong = 0;
  for (int tile = -1; tile <= 1; ++tile) {
    for (int to = 0; to < 64; ++to) {
      std::array<int, 3> at{to & 3, (to >> 2) & 3, to >> 4};
      const int place = at[kAxis] + 4 * tile;
      bool expected = false;
      for (at[kAxis] = 0; at[kAxis] < 4; ++at[kAxis])
        expected =
            expected || (has(units, at[0], at[1], at[2]) && std::abs(place - at[kAxis]) <= reach);
      const bool found =
          has(tiles[static_cast<std::size_t>(tile + 1)], to & 3, (to >> 2) & 3, to >> 4);
      if (found != expected) ++wrong;
    }
  }
  return wrong;
}

}  // namespace

TEST_CASE("units along an axis: those within reach of one, in the next tiles too") {
  Random random(73);
  std::size_t wrong = 0;
  for (int round = 0; round < 30; ++round) {
    const std::uint64_t units = random_mask(random) & random_mask(random);
    for (int reach = 0; reach <= 9; ++reach)
      wrong += wrong_along<0>(units, reach) + wrong_along<1>(units, reach) +
               wrong_along<2>(units, reach);
  }
  CHECK(wrong == 0);
  CHECK(units_along<0>(1, 1).below == 8);
  CHECK(units_along<2>(1, -3).own == 1);
}

TEST_CASE("tiles beside: made once, linked both ways, none beyond the grid") {
  constexpr ScanCapacity kCapacity{.points = 1, .tiles = 3, .ray_blocks = 1};
  alignas(kArenaAlignment) std::array<std::byte, ScanTiles::required_bytes(kCapacity)> memory{};
  Arena arena(memory);
  Result<ScanTiles> made = ScanTiles::make(arena, kCapacity);
  REQUIRE(made.ok());
  ScanTiles& tiles = *made;
  const std::uint32_t own = *tiles.ensure({kBlockLimit - 1, 2, 3});
  const std::uint32_t below = *tiles.ensure({kBlockLimit - 2, 2, 3});
  CHECK(tiles.beside(tiles.tiles()[own], 0) == nullptr);
  CHECK(*tiles.ensure_beside(own, 0) == below);
  CHECK(tiles.beside(tiles.tiles()[own], 0) == &tiles.tiles()[below]);
  CHECK(tiles.beside(tiles.tiles()[below], 1) == &tiles.tiles()[own]);
  CHECK(tiles.ensure_beside(own, 1).status() == Status::kOutOfRange);
  const std::uint32_t above = *tiles.ensure_beside(own, 5);
  CHECK(tiles.tiles()[above].coord == BlockCoord{kBlockLimit - 1, 2, 4});
  CHECK(*tiles.ensure_beside(above, 4) == own);
  CHECK(tiles.tiles().size() == 3);
  CHECK(tiles.ensure_beside(own, 3).status() == Status::kResourceExhausted);
  tiles.forget_points();
  CHECK(tiles.beside(tiles.tiles()[own], 5) == nullptr);
  CHECK(*tiles.ensure_beside(own, 5) == above);
}

TEST_CASE("at_least: counts the masks of each unit") {
  Random random(72);
  std::size_t wrong = 0;
  for (int round = 0; round < 300; ++round) {
    std::array<std::uint64_t, 6> masks{};
    for (std::uint64_t& mask : masks) mask = random_mask(random);
    for (int least = 1; least <= 7; ++least) {
      const std::uint64_t reached = at_least(masks, least);
      for (unsigned unit = 0; unit < 64; ++unit) {
        int count = 0;
        for (const std::uint64_t mask : masks) count += static_cast<int>((mask >> unit) & 1U);
        if ((((reached >> unit) & 1U) != 0) != (count >= least)) ++wrong;
      }
    }
  }
  CHECK(wrong == 0);
  CHECK(at_least({}, 1) == 0);
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  CHECK(at_least({kAll, kAll, kAll, kAll, kAll, kAll}, 6) == kAll);
  CHECK(at_least({kAll, kAll, kAll, kAll, kAll, kAll}, 7) == 0);
}

TEST_CASE("place_of: negative voxels floor like positive ones") {
  const int edge = GENERATE(1, 2, 4);
  CAPTURE(edge);
  std::size_t wrong = 0;
  for (int v = -70; v <= 70; ++v) {
    const int w = 3 * v + 1;
    const VoxelCoord voxel{v, -v, w};
    const ScanTiles::Place place = ScanTiles::place_of(voxel, edge);
    const std::array<int, 3> units{floor_divide(v, edge), floor_divide(-v, edge),
                                   floor_divide(w, edge)};
    const std::array<int, 3> tiles{floor_divide(units[0], 4), floor_divide(units[1], 4),
                                   floor_divide(units[2], 4)};
    const int unit =
        units[0] - 4 * tiles[0] + 4 * (units[1] - 4 * tiles[1]) + 16 * (units[2] - 4 * tiles[2]);
    const bool right = place.tile == BlockCoord{tiles[0], tiles[1], tiles[2]} && place.unit == unit;
    if (!right) ++wrong;
  }
  CHECK(wrong == 0);
  CHECK(ScanTiles::place_of({-1, -1, -1}, edge).tile == BlockCoord{-1, -1, -1});
  CHECK(ScanTiles::place_of({-1, -1, -1}, edge).unit == 63);
}

TEST_CASE("units around: the masks together are the cube, each unit once") {
  const int reach = GENERATE(0, 1, 2, 5);
  CAPTURE(reach);
  const BlockCoord tile{-1, 0, 2};
  for (int unit = 0; unit < 64; ++unit) {
    const std::array<int, 3> at{-4 + (unit & 3), (unit >> 2) & 3, 8 + (unit >> 4)};
    int covered = 0;
    bool inside = true;
    for_units_around(tile, unit, reach, [&](const BlockCoord& coord, std::uint64_t mask) {
      for (int u = 0; u < 64; ++u) {
        if (!has(mask, u & 3, (u >> 2) & 3, u >> 4)) continue;
        ++covered;
        inside = inside && std::abs(coord.x * 4 + (u & 3) - at[0]) <= reach &&
                 std::abs(coord.y * 4 + ((u >> 2) & 3) - at[1]) <= reach &&
                 std::abs(coord.z * 4 + (u >> 4) - at[2]) <= reach;
      }
      return true;
    });
    const int side = 2 * reach + 1;
    REQUIRE(inside);
    REQUIRE(covered == side * side * side);
  }
}

TEST_CASE("octets of a unit: they cover the unit's voxels, each once, in the right block") {
  const int edge = GENERATE(1, 2, 4);
  const int tile_x = GENERATE(-3, -2, 0, 5);
  CAPTURE(edge, tile_x);
  const Tile tile{.coord = {tile_x, 1, -1}};
  std::size_t wrong = 0;
  for (int unit = 0; unit < 64; ++unit) {
    const UnitOctets octets = octets_of_unit(unit, edge);
    int covered = 0;
    for (const OctetPlace& octet : octets.places()) {
      const BlockOctet at = locate(tile, octet, edge);
      const BlockCoord block = block_of_tile(tile.coord, edge, at.block);
      for (int v = 0; v < kOctetVoxels; ++v) {
        if (((unsigned{octet.voxels} >> static_cast<unsigned>(v)) & 1U) == 0) continue;
        ++covered;
        const ScanTiles::Place place = ScanTiles::place_of(voxel_at(block, at.octet, v), edge);
        const bool right =
            place.tile == tile.coord && place.unit == unit &&
            (units_of_block(edge, at.block) >> static_cast<unsigned>(unit) & 1U) != 0;
        if (!right) ++wrong;
      }
    }
    if (covered != edge * edge * edge) ++wrong;
  }
  CHECK(wrong == 0);
}

}  // namespace tessera
