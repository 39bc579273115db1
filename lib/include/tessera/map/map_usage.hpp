// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera {

/// How full a map is. Counters of refusals never decrease but by clear().
struct MapUsage {
  std::size_t capacity_bytes = 0;  ///< required_bytes of the configuration.
  std::size_t used_bytes = 0;      ///< Pages in use with their slack, and the index's table.
  std::size_t peak_bytes = 0;      ///< Largest used_bytes so far.
  std::uint64_t blocks = 0;
  std::uint64_t label_voxels = 0;    ///< Voxels with evidence in 1 .. C + 1.
  std::uint64_t blocks_refused = 0;  ///< Blocks not opened: storage full, or no place in the index.
  std::uint64_t storage_refused = 0;  ///< Pages and octets not given for lack of storage.
};

/// A place in the order in which LocalMap::visit_blocks goes around; of use whatever becomes of the
/// blocks.
struct SweepCursor {
  std::size_t place = 0;
};

}  // namespace tessera
