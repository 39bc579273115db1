// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What may be asked of a robot's maps, for C. tessera.h says what all functions refuse.
#pragma once

#include "tessera/c/config.h"
#include "tessera/c/report.h"

#ifdef __cplusplus
extern "C" {
#endif

// --- Asking, from the robot's thread --------------------------------------------------------

/// The voxel at p (x y z, metres, frame of the map; unknown if out of the grid). O(1).
tessera_status tessera_query(const tessera_robot* robot, uint32_t map, const float* p,
                             tessera_estimate* estimate);
/// The same for count points (x y z each); estimates: as many. Faster than one by one.
tessera_status tessera_query_many(const tessera_robot* robot, uint32_t map, const float* points,
                                  uint32_t count, tessera_estimate* estimates);
/// The first occupied voxel from origin along direction, within max_range_m. TESSERA_BUSY iff the
/// global map is not settled. O(range in voxels).
tessera_status tessera_cast_ray(const tessera_robot* robot, uint32_t map, const float* origin,
                                const float* direction, double max_range_m, int32_t stop_at_unknown,
                                tessera_ray_hit* hit);
/// The occupied voxel nearest to p. Blocks are looked at outwards from p, until no nearer one is
/// possible or max_work is used up: a block that the map does not have, or that is too far off,
/// costs 1, another 16 (512 voxels); at most max_work + 15. nearest->complete says which;
/// docs/reference/queries.md has what a radius takes. Fails with TESSERA_OUT_OF_RANGE iff p is not
/// in the grid; TESSERA_INVALID_ARGUMENT iff radius_m is not above 0 or over 2^20 voxels, or
/// max_work is not 1 .. 2^30; TESSERA_BUSY as above.
tessera_status tessera_nearest_occupied(const tessera_robot* robot, uint32_t map, const float* p,
                                        double radius_m, uint32_t max_work,
                                        tessera_nearest* nearest);
/// Begins a walk through the box between two corners (metres; clipped to the grid).
tessera_status tessera_box_begin(const tessera_robot* robot, uint32_t map, const float* low,
                                 const float* high, tessera_box_cursor* cursor);
/// The next observed voxels of the box, block by block: count of them, at most capacity. Looks up
/// 4096 blocks at most, so count may be 0 before cursor->done is 1. Blocks come in the order of
/// (z, y, x), or in that of the map's index where the box has more blocks than the map.
/// TESSERA_INVALID_ARGUMENT iff the cursor is none that tessera_box_begin began; TESSERA_BUSY as
/// above.
tessera_status tessera_box_next(const tessera_robot* robot, tessera_box_cursor* cursor,
                                tessera_voxel* voxels, uint32_t capacity, uint32_t* count);
tessera_status tessera_map_usage_of(const tessera_robot* robot, uint32_t map,
                                    tessera_map_usage* usage);

// --- Asking, from other threads -------------------------------------------------------------

/// Makes a reader, for one thread, while the robot is not worked on.
tessera_status tessera_reader_make(const tessera_robot* robot, tessera_reader* reader);
/// As tessera_query, while the robot is worked on. TESSERA_BUSY iff the voxel was being changed all
/// the time: try again later.
tessera_status tessera_reader_query(tessera_reader* reader, uint32_t map, const float* p,
                                    tessera_estimate* estimate);
/// The probability of each component of the voxel at p, while the robot is worked on: free, class
/// 1 .. C, occupied without a class. What is missing to 1 is evidence whose class is not known any
/// more. Without evidence, or out of the grid, all are equal (0 if the prior is 0). count: room in
/// probabilities, of which the first C + 2 are written. TESSERA_INVALID_ARGUMENT iff it is less
/// than that; TESSERA_BUSY as above.
tessera_status tessera_reader_probabilities(tessera_reader* reader, uint32_t map, const float* p,
                                            double* probabilities, uint32_t count);

#ifdef __cplusplus
}  // extern "C"
#endif
