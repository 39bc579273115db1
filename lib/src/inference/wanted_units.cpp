// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/wanted_units.hpp"

namespace tessera {

namespace {

/// Units of a tile that some of a tile's points reach, and the way there from that tile: bit number
/// of Tile::sources, if no point reaches beyond the next tile.
struct Reached {
  std::uint32_t tile = 0;
  std::uint64_t units = 0;
  int source = 0;
};

/// Calls visit(Reached) for the tiles after a tile on an axis, or before it, that hold units within
/// reach of its ones, making them; nearest: those of the first. False: visit gave false, or there
/// is no room for a tile.
template <std::size_t kAxis, class Visit>
bool for_tiles_beside(ScanTiles& tiles, const Reached& from, std::uint64_t nearest, bool up,
                      int reach, Visit&& visit) noexcept {
  constexpr int kSourceStep = kAxis == 0 ? 1 : (kAxis == 1 ? 3 : 9);
  Reached at{from.tile, nearest, from.source};
  while (at.units != 0) {
    const Result<std::uint32_t> next = tiles.ensure_beside(at.tile, 2 * kAxis + (up ? 1 : 0));
    if (next.status() == Status::kOutOfRange) return true;  // the grid ends
    if (!next.ok()) return false;
    at.tile = *next;
    // From there, the way back is the opposite one.
    at.source -= up ? kSourceStep : -kSourceStep;
    if (!visit(at)) return false;
    reach -= 4;
    const UnitsAlong farther = units_along<kAxis>(from.units, reach);
    at.units = up ? farther.above : farther.below;
  }
  return true;
}

/// The same for the tile itself and those on both sides.
template <std::size_t kAxis, class Visit>
bool for_tiles_along(ScanTiles& tiles, const Reached& from, int reach, Visit&& visit) noexcept {
  const UnitsAlong near = units_along<kAxis>(from.units, reach);
  return visit(Reached{from.tile, near.own, from.source}) &&
         for_tiles_beside<kAxis>(tiles, from, near.below, false, reach, visit) &&
         for_tiles_beside<kAxis>(tiles, from, near.above, true, reach, visit);
}

/// Boxes of units are what reaches on all three axes: one axis after the other. Tiles are linked on
/// the way along x, then y, then z; sum_strip goes it back.
bool want_kernel_units(ScanTiles& tiles, int reach) noexcept {
  constexpr int kHere = 13;  // in Tile::sources
  const bool next_only = reach <= 4;
  const auto want = [&](const Reached& at) {
    Tile& tile = tiles.tiles()[at.tile];
    tile.wanted |= at.units;
    if (next_only) tile.sources |= 1U << static_cast<unsigned>(at.source);
    return true;
  };
  const auto along_z = [&](const Reached& at) {
    return for_tiles_along<2>(tiles, at, reach, want);
  };
  const auto along_y = [&](const Reached& at) {
    return for_tiles_along<1>(tiles, at, reach, along_z);
  };
  const std::size_t with_points = tiles.tiles().size();
  for (std::size_t i = 0; i < with_points; ++i) {
    const Reached own{static_cast<std::uint32_t>(i), tiles.tiles()[i].occupied, kHere};
    if (!for_tiles_along<0>(tiles, own, reach, along_y)) return false;
  }
  return true;
}

/// Units of a tile that have points, or are filled from at least as many neighbours as needed.
/// Tiles that are not linked have no say in each other.
std::uint64_t units_with_evidence(const ScanTiles& tiles, const InferenceConfig& config,
                                  const Tile& tile) noexcept {
  std::array<std::uint64_t, 6> faces{};
  for (std::size_t face = 0; face < 6; ++face) {
    const Tile* const beside = tiles.beside(tile, face);
    faces[face] = beside == nullptr ? 0 : beside->occupied;
  }
  return tile.occupied |
         at_least(neighbour_masks(tile.occupied, faces), config.entropy.fill_neighbours);
}

}  // namespace

bool want_units(ScanTiles& tiles, const InferenceConfig& config, KernelReach reach,
                int num_classes) noexcept {
  if (config.mode == InferenceMode::kKernel) return want_kernel_units(tiles, reach.units);
  const std::size_t with_points = tiles.tiles().size();
  for (std::size_t i = 0; i < with_points; ++i) tiles.tiles()[i].wanted = tiles.tiles()[i].occupied;
  if (config.mode == InferenceMode::kCounting) return true;
  measure_units(tiles, num_classes);
  // Filling takes points in at least one face neighbour, so only tiles beside a tile with points on
  // that face matter; tiles that are not linked have no say in each other.
  for (std::size_t i = 0; i < with_points; ++i) {
    const std::uint64_t occupied = tiles.tiles()[i].occupied;
    const std::array<std::uint64_t, 6> spill =
        neighbour_masks(0, {occupied, occupied, occupied, occupied, occupied, occupied});
    for (std::size_t face = 0; face < 6; ++face) {
      // spill[f ^ 1] is non-zero iff this tile has points on the side that touches the neighbour at
      // face f.
      if (spill[face ^ 1U] == 0) continue;
      const Status made = tiles.ensure_beside(static_cast<std::uint32_t>(i), face).status();
      if (made == Status::kResourceExhausted) return false;
    }
  }
  for (Tile& tile : tiles.tiles()) tile.wanted = units_with_evidence(tiles, config, tile);
  return true;
}

std::uint64_t receiving_units(const ScanTiles& tiles, const InferenceConfig& config,
                              const Tile& tile, std::uint64_t reached) noexcept {
  if (!by_entropies(config.mode) || (reached & ~tile.occupied) == 0) return reached;
  return reached & units_with_evidence(tiles, config, tile);
}

}  // namespace tessera
