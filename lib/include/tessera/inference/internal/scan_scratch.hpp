// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where the evidence of a scan is gathered before it is written: the tiles of its points and the
// blocks of its rays.
#pragma once

#include "tessera/inference/internal/free_space.hpp"
#include "tessera/inference/internal/scan_tiles.hpp"

namespace tessera {

struct ScanScratch {
  ScanTiles tiles{};
  FreeSpace free_space{};  ///< Without memory, and empty, where no space is freed.
};

}  // namespace tessera
