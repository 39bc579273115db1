// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which units may receive evidence of the points that are in the tiles, and the tiles for them.
#pragma once

#include "tessera/inference/inference_config.hpp"
#include "tessera/inference/internal/kernel_reach.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"

namespace tessera {

/// Sets Tile::wanted of all tiles, and in the kernel mode Tile::sources, making and linking tiles
/// that have no points; measures the units of the mode multi-entropy. False: there is no room for
/// a tile. O(tiles), in the kernel mode times the tiles in reach.
[[nodiscard]] bool want_units(ScanTiles& tiles, const InferenceConfig& config, KernelReach reach,
                              int num_classes) noexcept;

/// Of the units of a tile that a point in reach could bring evidence to, those that may receive
/// some with the points in the tiles now, as want_units() finds them.
[[nodiscard]] std::uint64_t receiving_units(const ScanTiles& tiles, const InferenceConfig& config,
                                            const Tile& tile, std::uint64_t reached) noexcept;

}  // namespace tessera
