// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The numbers of a scan's report, each written once: kind, type, name, sentence
// (base/counters.hpp). Also for C, whose struct has them in this order: append, and 32-bit ones in
// pairs.
#pragma once

#define TESSERA_SCAN_COUNTERS(ROW)                                                                 \
  ROW(COUNTER, uint32_t, points, "Returns given.")                                                 \
  ROW(COUNTER, uint32_t, non_finite,                                                               \
      "Returns refused: NaN or infinite coordinates, a weight that is not in 0 .. 1e6, or no "     \
      "return from a direction that is none.")                                                     \
  ROW(COUNTER, uint32_t, too_near, "Returns refused: nearer than min_range_m.")                    \
  ROW(COUNTER, uint32_t, beyond_range, "Returns farther than max_range_m: they only free space.")  \
  ROW(COUNTER, uint32_t, out_of_grid,                                                              \
      "Returns refused: outside the grid; in range and over 2^19 voxels or thinning cells from "   \
      "the sensor; or beyond the range and over 10^7 m from it.")                                  \
  ROW(COUNTER, uint32_t, unlabelled, "Returns in range of unknown class.")                         \
  ROW(COUNTER, uint32_t, over_capacity,                                                            \
      "Returns left out: more than the scan has memory for; it was sampled evenly.")               \
  ROW(COUNTER, uint32_t, thinned, "Points after thinning.")                                        \
  ROW(COUNTER, uint32_t, admitted, "Thinned points that were integrated.")                         \
  ROW(COUNTER, uint32_t, refused_storage, "Thinned points left out: no room in the map.")          \
  ROW(COUNTER, uint32_t, refused_tiles,                                                            \
      "Thinned points left out: no room in the scratch for labels.")                               \
  ROW(COUNTER, uint32_t, refused_ray_blocks,                                                       \
      "Thinned points left out: no room in the scratch for rays.")                                 \
  ROW(COUNTER, uint32_t, refused_work, "Thinned points left out: the work budget.")                \
  ROW(COUNTER, uint32_t, refused_deadline,                                                         \
      "Thinned points left out: the deadline, as it was foreseen.")                                \
  ROW(COUNTER, uint32_t, rays,                                                                     \
      "Rays traced: of admitted points, and beyond the range limit. Carving by the image: "        \
      "returns "                                                                                   \
      "in it.")                                                                                    \
  ROW(COUNTER, uint32_t, rays_refused_memory, "Rays beyond the range limit left out: memory.")     \
  ROW(COUNTER, uint32_t, rays_refused_work,                                                        \
      "Rays beyond the range limit left out: the work budget.")                                    \
  ROW(COUNTER, uint32_t, rays_refused_deadline,                                                    \
      "Rays beyond the range limit left out: the deadline, as it was foreseen.")                   \
  ROW(COUNTER, uint32_t, returns_cut,                                                              \
      "Returns of a scan that was not registered in time: all but those over capacity.")           \
  ROW(COUNTER, uint32_t, rays_cut, "Rays not traced in time.")                                     \
  ROW(COUNTER, uint32_t, tiles_cut, "Tiles not written in time.")                                  \
  ROW(COUNTER, uint32_t, points_cut, "Admitted points in these.")                                  \
  ROW(COUNTER, uint32_t, ray_blocks_cut, "Blocks traced and not carved in time.")                  \
  ROW(TOTAL, uint32_t, left_out,                                                                   \
      "Returns, thinned points and rays that could have been integrated but were not.")            \
  ROW(LEVEL, int64_t, overshoot_us,                                                                \
      "Microseconds by which the scan ended late; 0: in time, or no deadline.")                    \
  ROW(LEVEL, uint64_t, work_limit,                                                                 \
      "The limit of work that applied: the work budget, or what fits the deadline; 0: none.")      \
  ROW(TOTAL, uint64_t, work_spent, "Kernel evaluations and ray steps done.")                       \
  ROW(COUNTER, uint64_t, voxel_updates, "Contributions added: pairs of a point and a voxel.")      \
  ROW(COUNTER, uint32_t, label_octets, "Octets of labels written.")                                \
  ROW(COUNTER, uint32_t, free_blocks, "Blocks carved.")                                            \
  ROW(COUNTER, uint32_t, in_range, "Returns that were registered as hits.")                        \
  ROW(COUNTER, uint32_t, write_faults,                                                             \
      "Writes of what was admitted that failed: 0, or the library is at fault.")                   \
  ROW(LEVEL, uint64_t, work_predicted,                                                             \
      "Bound of the work of what was admitted, which work_spent stays under; 0 without a limit.")  \
  ROW(LEVEL, uint32_t, tiles, "Tiles of scratch used.")                                            \
  ROW(LEVEL, uint32_t, ray_blocks, "Ray blocks of scratch used.")                                  \
  ROW(COUNTER, uint64_t, evaluations, "Voxels for which kernels were evaluated, in reach or not.") \
  ROW(COUNTER, uint64_t, ray_steps,                                                                \
      "Voxels stepped through by rays, twice where a scan did not fit at first; blocks on rays "   \
      "admitted singly; of an image, cubes, and 32 a block.")                                      \
  ROW(COUNTER, uint32_t, strips, "Kernel mode: runs of tiles that were summed together.")          \
  ROW(COUNTER, uint32_t, free_blocks_refused,                                                      \
      "Carving by the image: blocks left out, as there was no room in the map.")                   \
  ROW(COUNTER, uint32_t, carving_cut,                                                              \
      "Carving by the image: scans whose free space was left out in part, for lack of scratch, "   \
      "time or work budget.")                                                                      \
  ROW(TOTAL, uint32_t, refused_memory, "Thinned points left out because map or scratch was full.") \
  ROW(TOTAL, uint32_t, rays_refused, "Rays beyond the range limit left out.")                      \
  ROW(TOTAL, uint32_t, left_out_deadline,                                                          \
      "Returns, thinned points and rays left out by the deadline.")                                \
  ROW(TOTAL, uint32_t, points_kept, "Thinned points whose evidence is in the map.")                \
  ROW(TOTAL, uint32_t, rays_wanted,                                                                \
      "Rays of all thinned points, and of all thinned directions beyond the range limit; 0 "       \
      "without free space.")                                                                       \
  ROW(COUNTER, uint32_t, on_body,                                                                  \
      "Returns, and directions to be cleared, refused: on the robot's own body.")                  \
  ROW(COUNTER, uint32_t, no_return, "Directions from which nothing came back.")                    \
  ROW(COUNTER, uint32_t, voxels_doubted,                                                           \
      "Carving by the image: occupied voxels that were seen through and whose labels were "        \
      "reduced.")                                                                                  \
  ROW(COUNTER, uint32_t, voxels_cleared,                                                           \
      "Carving by the image: occupied voxels that were seen through and are free now.")            \
  ROW(COUNTER, uint32_t, on_teammate, "Returns refused: on another robot that says where it is.")  \
  ROW(LEVEL, uint32_t, teammates, "Places of other robots that returns were compared with.")       \
  ROW(COUNTER, uint32_t, weighted_labels, "Returns in range whose weight is shared by labels.")    \
  ROW(COUNTER, uint32_t, wrong_labels,                                                             \
      "Returns in range whose label weights sum to more than one: taken as unlabelled.")
