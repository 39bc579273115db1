// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the tiles and ray blocks of a scan may take of the map's storage beyond what the map has:
// bounds that the writing stays under.
#pragma once

#include "tessera/inference/internal/free_space.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// Adds to wanted a bound on what writing these units takes, and notes the blocks that are open.
/// counted: units counted before. O(blocks of the tile).
void count_tile(const LocalMap& map, int unit_edge, Tile& tile, std::uint64_t units,
                std::uint64_t counted, SlabPool::Counts& wanted) noexcept;
/// The same for a ray block. Its block is looked up once a scan, and again only while it is not
/// open: a tile may open it.
void count_ray_block(const LocalMap& map, RayBlock& ray_block, SlabPool::Counts& wanted) noexcept;
/// Opens the map's blocks that these units lie in. False: the map's index refused one.
[[nodiscard]] bool open_tile(LocalMap& map, int unit_edge, Tile& tile,
                             std::uint64_t units) noexcept;

}  // namespace tessera
