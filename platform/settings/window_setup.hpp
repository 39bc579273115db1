// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a window around the robot does where memory is short, the same for every run that has one.
#pragma once

#include "settings/map_options.hpp"

namespace tessera {

/// Room for half of what the map's storage holds, in the proportions of WindowConfig::reserve.
SlabPool::Counts half_of_storage(const MapSetup& setup);

/// Lets a window move all blocks that it has to, however far scans are apart: for runs that may
/// wait for their archive.
void move_all_at_once(WindowConfig& window);

/// Lets blocks within a window that has an archive leave it too, the farthest first, where the map
/// has no room for a scan. may_wait: as many as it takes, however long. After split_budget; without
/// a window, or an archive for it, nothing.
void let_near_blocks_leave(MapSetup& setup, bool may_wait);

}  // namespace tessera
