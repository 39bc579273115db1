// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The numbers of a window's report, each written once: kind, type, name, sentence
// (base/counters.hpp). Also for C, whose struct has them in this order: append 64-bit ones.
#pragma once

#define TESSERA_WINDOW_COUNTERS(ROW)                                                              \
  ROW(COUNTER, uint64_t, evicted, "Blocks that left the window.")                                 \
  ROW(COUNTER, uint64_t, evictions_refused,                                                       \
      "Blocks that the archive did not take, or that wait until they are published.")             \
  ROW(COUNTER, uint64_t, reloaded, "Blocks loaded again.")                                        \
  ROW(COUNTER, uint64_t, merged, "Reloaded blocks that were added to a block of the map.")        \
  ROW(COUNTER, uint64_t, reloads_failed,                                                          \
      "Loads that failed for another reason than lack of room.")                                  \
  ROW(COUNTER, uint64_t, steps_without_room,                                                      \
      "Steps in which blocks could not be loaded for lack of room.")                              \
  ROW(LEVEL, uint64_t, backlog, "Blocks that wait to leave or to be loaded after the last step.") \
  ROW(LEVEL, uint64_t, most_backlog, "Most blocks that waited after a step.")                     \
  ROW(COUNTER, uint64_t, unpublished_blocks,                                                      \
      "Blocks that left, for lack of memory, before others had all of them; others have them "    \
      "once they are back in the map. 0 where nothing is published.")                             \
  ROW(LEVEL, uint64_t, most_evicted, "Most blocks that left in one step.")                        \
  ROW(LEVEL, uint64_t, most_reloaded, "Most blocks that were loaded in one step.")                \
  ROW(COUNTER, uint64_t, lost_blocks,                                                             \
      "Blocks that left without an archive: their evidence is lost.")                             \
  ROW(COUNTER, uint64_t, near_evicted,                                                            \
      "Of those that left, blocks within the window: the farthest first, as memory was short.")   \
  ROW(LEVEL, uint64_t, reach_blocks,                                                              \
      "How far the window reached in the last step, in edges of a block: less than it may where " \
      "memory is short.")
