// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What became of every scan, image and pose: one counter for each outcome. Counters never decrease.
#pragma once

#include <cstdint>

#include "tessera/base/counters.hpp"

namespace tessera {

struct TimelinessCounts {
  std::uint64_t future = 0;   ///< Stamped more than max_future_us ahead of now.
  std::uint64_t ancient = 0;  ///< Stamped more than max_age_us before now.
};

#define TESSERA_MATCH_COUNTERS(ROW)                                                               \
  ROW(COUNTER, uint64_t, given, "Scans given out.")                                               \
  ROW(COUNTER, uint64_t, unknown_sensor,                                                          \
      "Scans of a sensor, or a kind of message, that is not configured.")                         \
  ROW(COUNTER, uint64_t, duplicates, "Scans of a sensor and a stamp that are known.")             \
  ROW(COUNTER, uint64_t, out_of_order, "Scans older than one of this sensor that was given out.") \
  ROW(COUNTER, uint64_t, without_pose, "Scans without a pose.")                                   \
  ROW(COUNTER, uint64_t, without_images,                                                          \
      "Scans dropped for lack of images, where missing_images says so.")                          \
  ROW(COUNTER, uint64_t, superseded,                                                              \
      "Scans replaced by newer ones before there was room for them.")                             \
  ROW(COUNTER, uint64_t, dropped_by_step, "Scans dropped by a step of the sensors' clock.")       \
  ROW(COUNTER, uint64_t, unlabelled, "Scans given out that need images and have none.")           \
  ROW(COUNTER, uint64_t, partly_unlabelled, "Scans given out with some of their images.")         \
  ROW(COUNTER, uint64_t, sweep_beyond_poses,                                                      \
      "Scans given out whose poses end before their sweep or their images.")                      \
  ROW(COUNTER, uint64_t, images, "Images taken.")                                                 \
  ROW(COUNTER, uint64_t, unknown_camera, "Images of a camera that is not configured.")            \
  ROW(COUNTER, uint64_t, images_out_of_order,                                                     \
      "Images older than one before them, or of the same stamp.")                                 \
  ROW(COUNTER, uint64_t, poses, "Poses taken.")                                                   \
  ROW(COUNTER, uint64_t, poses_out_of_order,                                                      \
      "Poses older than one before them, or of the same stamp.")                                  \
  ROW(COUNTER, uint64_t, poses_not_rigid, "Poses that are not rigid.")                            \
  ROW(COUNTER, uint64_t, clock_steps,                                                             \
      "Steps of the sensors' clock: everything that waited was dropped.")

struct MatchReport {
  TESSERA_MATCH_COUNTERS(TESSERA_COUNTER_MEMBER)
  TimelinessCounts scans{};
  TimelinessCounts image_stamps{};
  TimelinessCounts pose_stamps{};
};
TESSERA_COUNTER_TABLE(MatchReport, TESSERA_MATCH_COUNTERS(TESSERA_COUNTER_ROW))

}  // namespace tessera
