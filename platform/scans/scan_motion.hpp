// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Times of the scans of a dataset, and poses of the robot in between: times.txt, and
// poses_dense.txt or the poses of the scans.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/outcome.hpp"
#include "scans/pose_file.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/registration/pose_track.hpp"

namespace tessera {

/// The seconds of each scan, from a file of one number a line, as microseconds. Fails with kUsage,
/// naming file, line and remedy, iff it cannot be read, is malformed, or they do not rise.
Outcome<std::vector<std::int64_t>> read_times(const std::string& path);

/// The poses of a dataset.
struct KnownPoses {
  std::span<const Matrix34d> T_map_sensor;           ///< Of each row of poses.txt.
  Matrix34d T_camera_lidar = Matrix34d::Identity();  ///< Of calib.txt, as poses_dense.txt needs it.
};

class ScanMotion {
 public:
  /// dir/times.txt has the seconds of each scan, rising; dir/poses_dense.txt, if it exists, rows
  /// of 13 numbers: seconds, rising, and a pose as in poses.txt. Rows whose pose is not rigid are
  /// left out. Fails with kUsage, naming file, line and remedy, iff times.txt is missing or has
  /// fewer rows than num_scans, either cannot be read or is malformed, or there are more than
  /// PoseTrack::kMostPoses poses.
  static Outcome<ScanMotion> load(const std::string& dir, const KnownPoses& poses,
                                  std::size_t num_scans);

  /// Of the rows of a file of poses, one for each scan; none if they have no stamps, or stamps that
  /// do not rise by a microsecond at least, or there are more than PoseTrack::kMostPoses.
  static std::optional<ScanMotion> of(const PoseRows& rows);

  /// number: of a scan, under num_scans.
  [[nodiscard]] std::int64_t stamp_us(int number) const {
    return stamps_us_[static_cast<std::size_t>(number)];
  }
  [[nodiscard]] const PoseTrack& track() const noexcept { return track_; }

 private:
  Outcome<void> fill(const std::vector<StampedPose>& poses, const std::string& path);

  std::vector<std::int64_t> stamps_us_;
  ArenaMemory memory_;
  PoseTrack track_;
};

}  // namespace tessera
