// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The numbers of a robot's objections, each written once: kind, type, name, sentence
// (base/counters.hpp).
#pragma once

#define TESSERA_OBJECTION_COUNTERS(ROW)                                                          \
  ROW(LEVEL, uint32_t, watched_blocks, "Blocks whose voxels others have and this map has free.") \
  ROW(LEVEL, uint32_t, objections, "Blocks that this robot objects to voxels of.")               \
  ROW(RESERVED, uint32_t, reserved, "")                                                          \
  ROW(COUNTER, uint64_t, objected_voxels, "Voxels that it has objected to.")                     \
  ROW(COUNTER, uint64_t, lapsed_objections, "Times that such a block was published anew.")       \
  ROW(COUNTER, uint64_t, answered_objections,                                                    \
      "Blocks published again, as scans meet what others object to.")                            \
  ROW(COUNTER, uint64_t, refused_objections, "Times that there was no room to say so.")
