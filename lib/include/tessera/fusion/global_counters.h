// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The numbers of the global map's report, each written once: kind, type, name, sentence
// (base/counters.hpp). Also for C, whose struct has them in this order.
#pragma once

/// How the global map stands.
#define TESSERA_GLOBAL_STATE(ROW)                                                        \
  ROW(LEVEL, uint32_t, blocks, "Blocks of the global grid.")                             \
  ROW(LEVEL, uint32_t, overlap_blocks, "Of these, those of more than one contribution.") \
  ROW(LEVEL, uint32_t, waiting, "Blocks that are behind what has arrived.")              \
  ROW(LEVEL, uint64_t, nodes, "Voxels of the graph.")

#define TESSERA_GLOBAL_FIGURES(ROW)                                               \
  ROW(FIGURE, double, residual, "max |Z_n - Z_(n-1)| / max |B|, over the nodes.") \
  ROW(FIGURE, double, mean_variance,                                              \
      "Mean variance of the label over the nodes, by eq. 17 on the counts.")

#define TESSERA_GLOBAL_COUNTERS(ROW)                                                            \
  ROW(LEVEL, uint64_t, used_bytes, "Bytes of its memory that hold something, and scratch.")     \
  ROW(COUNTER, uint64_t, refused_blocks, "Times that a block of the global grid had no place.") \
  ROW(COUNTER, uint64_t, refused_sums,                                                          \
      "Times that sums had no place: the block was left undiffused.")                           \
  ROW(COUNTER, uint64_t, refused_outputs, "Times that the map had no room for a block.")        \
  ROW(COUNTER, uint64_t, torn_blocks,                                                           \
      "Blocks of a move that were shown early: no room to stage them.")

/// Behind all others in C: append 64-bit ones here.
#define TESSERA_GLOBAL_COUNTERS_LATER(ROW)                                                  \
  ROW(COUNTER, uint64_t, saturated_voxels, "Times that a voxel had over 255 passes.")       \
  ROW(LEVEL, uint64_t, sum_bytes, "Of used_bytes: undiffused sums.")                        \
  ROW(FIGURE, double, mean_variance_undiffused, "The same mean variance before diffusion.") \
  ROW(LEVEL, uint64_t, objected_voxels,                                                     \
      "Voxels without evidence through which other robots have seen since.")                \
  ROW(LEVEL, uint64_t, disputed_voxels,                                                     \
      "Voxels that keep such evidence, as more robots have it than saw through.")           \
  ROW(COUNTER, uint64_t, refused_tallies,                                                   \
      "Times that there was no place for what a block says of the robots' labels.")         \
  ROW(LEVEL, uint64_t, out_of_grid,                                                         \
      "Contributions left out: where their robot is placed, they would be out of the grid.")
