// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot has published, as a local map: its contribution to the global map.
#pragma once

#include "maps/stored_map.hpp"
#include "tessera/robot/robot.hpp"

namespace tessera {

struct PublishedMap {
  ArenaMemory memory;
  LocalMap map;
};

/// With compact counts, which hold the content of records: three classes and a rest; bit-exact if
/// the quantum for the map's cap of evidence is 2^-14 or less (CompactTuple).
/// Fails with kFailure iff the system does not give the memory. Uses the heap.
Outcome<std::unique_ptr<PublishedMap>> published_map(const Robot& robot);

}  // namespace tessera
