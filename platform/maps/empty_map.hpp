// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A map without content, for what a file says of all that follows.
#pragma once

#include "base/arena_memory.hpp"
#include "base/outcome.hpp"
#include "tessera/map/local_map.hpp"

namespace tessera {

/// One with the settings and classes of another. memory: gets what it lies in. Fails with kFailure
/// iff the system does not give that.
Outcome<LocalMap> make_empty_map(const LocalMap& like, ArenaMemory& memory);

}  // namespace tessera
