// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What became of every scan, image and pose: one counter for each outcome. Counters never decrease.
#pragma once

#include <cstdint>

namespace tessera {

struct TimelinessCounts {
  std::uint64_t future = 0;   ///< Stamped more than max_future_us ahead of now.
  std::uint64_t ancient = 0;  ///< Stamped more than max_age_us before now.
};

struct MatchReport {
  // Scans: each is counted in one of these, or waits.
  std::uint64_t given = 0;           ///< Given out.
  std::uint64_t unknown_sensor = 0;  ///< Of a sensor, or a kind of message, that is not configured.
  TimelinessCounts scans{};
  std::uint64_t duplicates = 0;    ///< A scan of this sensor with that stamp is known.
  std::uint64_t out_of_order = 0;  ///< Older than one of this sensor that was given out.
  std::uint64_t without_pose = 0;
  std::uint64_t without_images = 0;  ///< With MissingImages::kDrop.
  std::uint64_t superseded = 0;      ///< Replaced by newer ones before there was room for it.
  std::uint64_t dropped_by_step = 0;
  // Of the given out scans.
  std::uint64_t unlabelled = 0;          ///< Needs images and has none.
  std::uint64_t partly_unlabelled = 0;   ///< Has some of its images.
  std::uint64_t sweep_beyond_poses = 0;  ///< The poses end before its sweep or its images.
  // Images: each was taken or is counted in one of these.
  std::uint64_t images = 0;
  std::uint64_t unknown_camera = 0;
  TimelinessCounts image_stamps{};
  std::uint64_t images_out_of_order = 0;  ///< Or the same stamp again.
  // Poses: likewise.
  std::uint64_t poses = 0;
  TimelinessCounts pose_stamps{};
  std::uint64_t poses_out_of_order = 0;  ///< Or the same stamp again.
  std::uint64_t poses_not_rigid = 0;
  // Steps of the sensors' clock: everything that waited was dropped.
  std::uint64_t clock_steps = 0;
};

}  // namespace tessera
