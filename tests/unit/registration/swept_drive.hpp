// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A drive whose true poses are known, and sweeps on it.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "support/aligned_memory.hpp"
#include "tessera/registration/deskew.hpp"

namespace tessera {

inline constexpr std::int64_t kSweepStamp_us = 1'700'000'000'000'000;

/// A drive of 12 m/s on a curve of 1.5 rad/s with some pitch: the true pose at a time.
inline Matrix34d driven(double time_s) {
  Matrix34d T;
  const Eigen::Matrix3d R =
      (Eigen::AngleAxisd(0.4 + 1.5 * time_s, Eigen::Vector3d::UnitZ()) *
       Eigen::AngleAxisd(0.03 * std::sin(9.0 * time_s), Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  const double heading = 0.4 + 1.5 * time_s;
  T << R, Eigen::Vector3d(8.0 * (std::sin(heading) - std::sin(0.4)),
                          8.0 * (std::cos(0.4) - std::cos(heading)), 0.1 * time_s);
  return T;
}

struct DrivenTrack {
  explicit DrivenTrack(std::size_t capacity = 256)
      : memory(PoseTrack::required_bytes(capacity)), arena(memory.arena()) {
    track = *PoseTrack::make(capacity, arena);
  }
  /// Every step_us from first_us to last_us after the stamp.
  DrivenTrack& drive(std::int64_t first_us, std::int64_t last_us, std::int64_t step_us) {
    for (std::int64_t at = first_us; at <= last_us; at += step_us) {
      REQUIRE(track.add({kSweepStamp_us + at, driven(static_cast<double>(at) * 1e-6)}) ==
              Status::kOk);
    }
    return *this;
  }
  AlignedMemory memory;
  Arena arena;
  PoseTrack track;
};

inline Matrix34d mounted() {
  Matrix34d T = Matrix34d::Identity();
  T.leftCols<3>() =
      Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  T.col(3) = Eigen::Vector3d(1.2, -0.1, 1.6);
  return T;
}

struct SweptCloud {
  std::vector<float> points;  ///< x y z intensity
  std::vector<float> times_s;
  [[nodiscard]] Sweep sweep() const {
    Sweep sweep;
    sweep.points = {points.data(), 4, times_s.size()};
    sweep.times_s = times_s.data();
    sweep.stamp_us = kSweepStamp_us;
    sweep.T_body_sensor = mounted();
    return sweep;
  }
};

}  // namespace tessera
