// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A second digest of a map's content, which does not change with the library's: over all observed
// voxels in (z, y, x) order. Written again on purpose: equal by it is equal voxel for voxel.
#pragma once

#include "tessera/map/local_map.hpp"

namespace tessera::oracle {

[[nodiscard]] std::uint64_t digest_by_rows(const LocalMap& map);

}  // namespace tessera::oracle
