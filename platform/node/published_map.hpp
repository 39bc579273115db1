// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot has published, as a local map: its contribution to the global one.
#pragma once

#include "mapping/stored_map.hpp"
#include "node/robot.hpp"

namespace tessera {

struct PublishedMap {
  ArenaMemory memory;
  LocalMap map;
};

/// With dense counts and no cap, so that it holds every number as it was published. Fails with
/// kFailure iff the system does not give the memory. Uses the heap.
Outcome<std::unique_ptr<PublishedMap>> published_map(const Robot& robot);

}  // namespace tessera
