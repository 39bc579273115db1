// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a global map is made with, and what it reports.
#pragma once

#include "tessera/fusion/diffusion_config.hpp"
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
  std::uint32_t sum_segments = 1U << 16U;  ///< Undiffused sums, 128 bytes each.
  /// Storage for blocks that a move of contributions changes, until all of them are there.
  std::size_t staged_bytes = std::size_t{16} << 20U;
};

/// How things stand. Counters of refusals never decrease.
struct GlobalMapReport {
  std::uint64_t nodes = 0;
  std::uint32_t blocks = 0;
  std::uint32_t overlap_blocks = 0;
  std::uint32_t waiting = 0;              ///< Blocks that are behind.
  double residual = 0.0;                  ///< max |Z_n - Z_{n-1}| / max |B|, over the nodes.
  double mean_variance = 0.0;             ///< Of the label, over the nodes, as the map gives it.
  double mean_variance_undiffused = 0.0;  ///< The same of B.
  std::size_t used_bytes = 0;             ///< Of its memory: what holds something, and scratch.
  std::size_t sum_bytes = 0;              ///< Undiffused sums, of used_bytes.
  std::uint64_t refused_blocks = 0;       ///< Times that a block of the global grid had no place.
  std::uint64_t refused_sums = 0;         ///< Times that sums had no place: block left undiffused.
  std::uint64_t refused_outputs = 0;      ///< Times that the map had no room for a block.
  std::uint64_t torn_blocks = 0;          ///< Blocks of a move shown early: no room to stage them.
  std::uint64_t saturated_voxels = 0;     ///< Times that a voxel had over 255 passes.
  ReplicasUsage replicas{};
};

}  // namespace tessera
