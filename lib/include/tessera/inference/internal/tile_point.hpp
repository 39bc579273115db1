// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Nothing else here: units for one kind of machine include this.
#pragma once

#include <cstdint>

namespace tessera {

/// A point in tile-local coordinates: voxels from the tile's corner.
struct TilePoint {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
  float weight = 0.0F;
  std::uint8_t component = 0;
};

}  // namespace tessera
