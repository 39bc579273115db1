// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "vehicle/pose_assembly.hpp"
#include "vehicle/pose_guard.hpp"

namespace tessera {

inline constexpr std::int64_t kPeriodUs = 20'000;

/// A guard and a source of poses that drives along x at 2 m/s, every 20 ms.
struct PoseDrive {
  explicit PoseDrive(PoseGuardConfig config = {}) : guard(config) {}
  PoseObservation next() {
    now_us += kPeriodUs;
    x_m += 0.04;
    return at(x_m);
  }
  [[nodiscard]] PoseObservation at(double x, double heading = 0.0) const {
    SentPose sent;
    sent.p_map = Point3d(x, 1.0, 0.0);
    sent.heading_rad = heading;
    return {.pose = {now_us - 5'000, to_transform(sent)},
            .received_us = now_us,
            .std_position_m = 0.02,
            .std_heading_rad = 0.002};
  }
  /// Until poses are used; what the last of so many gave.
  PoseVerdict settle(int poses = 20) {
    PoseVerdict verdict = PoseVerdict::kNone;
    for (int i = 0; i < poses; ++i) verdict = guard.judge(next());
    return verdict;
  }
  PoseGuard guard;
  std::int64_t now_us = 1'000'000;
  double x_m = 0.0;
};

}  // namespace tessera
