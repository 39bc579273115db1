// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The numbers of what is held of robots, each written once: kind, type, name, sentence
// (base/counters.hpp). Also for C, whose report of the global map has them in this order.
#pragma once

#define TESSERA_REPLICA_COUNTERS(ROW)                                                             \
  ROW(LEVEL, uint32_t, contributions, "Contributions that are open.")                             \
  ROW(LEVEL, uint32_t, replica_blocks, "Parts of blocks that are held of them.")                  \
  ROW(LEVEL, uint64_t, replica_bytes, "Segments, records and the index's share of these blocks.") \
  ROW(COUNTER, uint64_t, replicas_stale, "Versions that came late or twice: ignored.")            \
  ROW(COUNTER, uint64_t, replicas_refused_storage,                                                \
      "Versions not taken: segments, blocks or index full.")                                      \
  ROW(COUNTER, uint64_t, replicas_refused_quota,                                                  \
      "Versions not taken: the robot's share is used up.")
