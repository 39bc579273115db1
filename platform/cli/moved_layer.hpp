// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What was in a map and went: voxels that are free by now, with a label that may move.
#pragma once

#include <vector>

#include "cli/export_layers.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// Colours these voxels by the class that they were of, and all others in one colour. Counts
/// `moved_voxels`, and `moved` by class. O(voxels).
[[nodiscard]] Layer color_by_what_moved(const ClassTable& classes, std::vector<PlyVoxel>& voxels);

}  // namespace tessera
