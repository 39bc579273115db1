// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "vehicle/vehicle_frames.hpp"

namespace tessera {

/// A good pose at a place, heading along x.
inline SentPose sent_pose(double x, double y = 0.0, double heading = 0.0) {
  SentPose pose;
  pose.p_map = Point3d(x, y, 0.5);
  pose.heading_rad = heading;
  pose.std_position_m = 0.02;
  pose.std_heading_rad = 0.003;
  pose.age_ms = 10.0;
  return pose;
}

}  // namespace tessera
