// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The numbers of a tick's report, each written once: kind, type, name, sentence
// (base/counters.hpp). Also for C, whose struct has them in this order: append, and 32-bit ones in
// pairs.
#pragma once

#define TESSERA_PUBLISHER_COUNTERS(ROW)                                                           \
  ROW(COUNTER, uint32_t, compared, "Blocks compared with what was published of them.")            \
  ROW(COUNTER, uint32_t, published, "Blocks published, emptied ones among them.")                 \
  ROW(COUNTER, uint32_t, emptied, "Blocks published as empty.")                                   \
  ROW(COUNTER, uint32_t, refused, "Blocks that the exchange did not take: tried again later.")    \
  ROW(COUNTER, uint32_t, left_out,                                                                \
      "Blocks for which there was no room: give more `candidates` or `blocks`.")                  \
  ROW(TOTAL, uint32_t, label_bytes, "Bytes published of labels.")                                 \
  ROW(TOTAL, uint32_t, free_bytes, "Bytes published of free space.")                              \
  ROW(LEVEL, uint32_t, waiting, "Labelled blocks that wait after the tick.")                      \
  ROW(LEVEL, uint32_t, free_waiting, "Blocks that wait with changes of free voxels alone.")       \
  ROW(LEVEL, uint32_t, overdue,                                                                   \
      "Of both, those that are late: more bytes or comparisons would have been needed.")          \
  ROW(RESERVED, uint32_t, reserved, "")                                                           \
  ROW(LEVEL, int64_t, worst_staleness_us,                                                         \
      "Longest time, at most, from a change of labelled voxels to its publication in this tick: " \
      "from the last time that the block was seen unchanged.")                                    \
  ROW(COUNTER, uint32_t, entries, "Entries of the map's index that were looked at.")              \
  ROW(COUNTER, uint32_t, noted, "Blocks found changed that did not wait already.")                \
  ROW(COUNTER, uint32_t, unchanged, "Blocks compared and dropped: they mean what was published.") \
  ROW(COUNTER, uint32_t, deferred,                                                                \
      "Blocks put off: too little is different, they are being changed, or no bytes are left.")   \
  ROW(COUNTER, uint32_t, partial,                                                                 \
      "Blocks that waited and were dropped, as they are not whole; not compared.")                \
  ROW(COUNTER, uint32_t, busy,                                                                    \
      "Blocks and pages that were in the middle of a change: tried again later.")                 \
  ROW(COUNTER, uint32_t, settled,                                                                 \
      "Blocks that may leave the map, as everything in them was published.")                      \
  ROW(RESERVED, uint32_t, reserved_2, "")
