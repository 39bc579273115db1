// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a global map is made with, and what it reports.
#pragma once

#include "tessera/base/counters.hpp"
#include "tessera/fusion/diffusion_config.hpp"
#include "tessera/fusion/global_counters.h"
#include "tessera/map/map_config.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

/// Settings and room of a global map.
struct GlobalMapConfig {
  /// Of the map that is read. max_evidence: 0; free_weight and prior: those of the contributions.
  MapConfig map{};
  /// The cap of the contributions' maps: a robot's share of a voxel is held to it
  /// (docs/design/theory.md). 0: kEvidenceWithoutCap; at most 1e6.
  float max_evidence = MapConfig{}.max_evidence;
  ReplicasConfig replicas{};
  DiffusionConfig diffusion{};
  std::uint32_t blocks = 1U << 15U;        ///< Blocks of the global grid.
  std::uint32_t sum_segments = 1U << 16U;  ///< Undiffused sums and tallies, 128 bytes each.
  /// Storage for blocks that a move of contributions changes, until all of them are there.
  std::size_t staged_bytes = std::size_t{16} << 20U;
  /// Each robot states frames in a world of its own, and counts once GlobalMap::place() says where
  /// that lies. False: all state frames in the global one.
  bool place_robots = false;
};

/// How things stand. Counters of refusals never decrease.
struct GlobalMapReport {
  TESSERA_GLOBAL_STATE(TESSERA_COUNTER_MEMBER)
  TESSERA_GLOBAL_FIGURES(TESSERA_COUNTER_MEMBER)
  TESSERA_GLOBAL_COUNTERS(TESSERA_COUNTER_MEMBER)
  TESSERA_GLOBAL_COUNTERS_LATER(TESSERA_COUNTER_MEMBER)
  ReplicasUsage replicas{};
};
TESSERA_COUNTER_TABLE(GlobalMapReport,
                      TESSERA_GLOBAL_STATE(TESSERA_COUNTER_ROW)
                          TESSERA_GLOBAL_FIGURES(TESSERA_COUNTER_ROW)
                              TESSERA_GLOBAL_COUNTERS(TESSERA_COUNTER_ROW)
                                  TESSERA_GLOBAL_COUNTERS_LATER(TESSERA_COUNTER_ROW))

}  // namespace tessera
