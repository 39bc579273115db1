// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A hall that several robots map, each in a frame of its own that nobody knows.
#pragma once

#include "frames_team.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

/// A world with the labels of the small robots.
inline SolidWorld with_two_labels(SolidWorld world) {
  for (Solid& solid : world.solids) solid.label = solid.label == 1 ? 1 : 2;
  return world;
}

inline Matrix34d map_frame(std::size_t i) {
  const auto n = static_cast<double>(i);
  return frame_of(70.0 * n, 1.0 + 0.5 * n, 40.0 * n, {3.0 - 5.0 * n, 4.0 * n - 2.0, 0.3 * n});
}

inline WorldView part_of_hall(double low_x_m, double high_x_m, const Matrix34d& T_map_world) {
  return {{low_x_m, -0.5, -0.5}, {high_x_m, 18.5, 3.5}, T_map_world, 0.2, false};
}

inline void map_hall(Robot& robot, double low_x_m, double high_x_m, const Matrix34d& T_map_world) {
  add_world(with_two_labels(large_hall()), part_of_hall(low_x_m, high_x_m, T_map_world),
            robot.mapper().maps().map());
}

/// How far a robot's world is from where it should be beside another's: at the middle of the hall.
inline double error_m(const SharedFrames& frames, std::uint32_t a, std::uint32_t b) {
  const Matrix34d* const T_team_a = frames.frame_of(a);
  const Matrix34d* const T_team_b = frames.frame_of(b);
  if (T_team_a == nullptr || T_team_b == nullptr) return 1e9;
  const Point3d middle(15.0, 9.0, 1.0);
  return norm(Point3d(apply(*T_team_a, apply(map_frame(a), middle)) -
                      apply(*T_team_b, apply(map_frame(b), middle))));
}

}  // namespace tessera
