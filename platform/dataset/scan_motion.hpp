// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// When a dataset's scans were taken, and where the robot was in between: times.txt, and
// poses_dense.txt or the scans' own poses.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "posix/outcome.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/registration/pose_track.hpp"

namespace tessera {

/// What is known of a dataset's poses.
struct KnownPoses {
  std::span<const Matrix34d> T_map_sensor;           ///< Of each row of poses.txt.
  Matrix34d T_camera_lidar = Matrix34d::Identity();  ///< Of calib.txt, as poses_dense.txt needs it.
};

class ScanMotion {
 public:
  /// Poses farther apart are not interpolated.
  static constexpr std::int64_t kMaxGap_us = 250'000;

  /// dir/times.txt has the seconds of each scan, rising; dir/poses_dense.txt, if it is there, rows
  /// of 13 numbers: seconds, rising, and a pose as in poses.txt. Rows whose pose is not rigid are
  /// left out. Fails with kUsage, naming file, line and remedy, iff times.txt is missing or has
  /// fewer rows than num_scans, either cannot be read or is malformed, or there are more than
  /// PoseTrack::kMostPoses poses.
  static Outcome<ScanMotion> load(const std::string& dir, const KnownPoses& poses,
                                  std::size_t num_scans);

  /// number: of a scan, under num_scans.
  [[nodiscard]] std::int64_t stamp_us(int number) const {
    return stamps_us_[static_cast<std::size_t>(number)];
  }
  [[nodiscard]] const PoseTrack& track() const noexcept { return track_; }

 private:
  struct alignas(kArenaAlignment) Line {
    std::byte bytes[kArenaAlignment];
  };
  Outcome<void> fill(const std::vector<StampedPose>& poses, const std::string& path);

  std::vector<std::int64_t> stamps_us_;
  std::vector<Line> memory_;
  PoseTrack track_;
};

}  // namespace tessera
