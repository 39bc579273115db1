// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The picture of two maps where a transform puts one.
#pragma once

#include <string>

#include "base/outcome.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// Occupied voxels of both maps in a's frame: of a, of b, and of both. Fails as write_png.
Outcome<void> write_alignment_png(const LocalMap& a, const LocalMap& b, const Matrix34d& T_a_b,
                                  const std::string& title, const std::string& path);

}  // namespace tessera
