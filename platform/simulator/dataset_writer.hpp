// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writes a simulated street to disk in the KITTI odometry / SemanticKITTI layout, one folder for
// each robot.
#pragma once

#include <filesystem>
#include <functional>

#include "base/outcome.hpp"
#include "simulator/street_simulator.hpp"

namespace tessera {

/// Standard deviations of an error in the pose of a robot's map: on each axis, and of the rotation
/// about each axis.
struct PoseError {
  double translation_m = 0.0;
  double rotation_deg = 0.0;
};

struct DatasetWriterOptions {
  /// Adds T_global_map_perturbed.txt iff either number is positive. Both must be finite and not
  /// negative.
  PoseError pose_error;
  /// Adds label images as a network would predict them, and the description of their cameras.
  bool cameras = false;
  /// Called after each scan with the number written so far and the total over all robots; may be
  /// empty.
  std::function<void(int done, int total)> progress;
};

/// Writes out/robot_K for each robot K: velodyne/NNNNNN.bin, labels/NNNNNN.label,
/// predictions/NNNNNN.label, poses.txt (T_map_sensor, 3x4 row-major: there is no calib.txt, so
/// poses are those of the scanner), times.txt (seconds) and T_global_map.txt (4x4 row-major, map to
/// street). With cameras also cameras.toml and cameras/C/NNNNNN.png, with swept scans
/// times/NNNNNN.bin (a float32 per point, seconds from the scan's stamp); with either
/// poses_dense.txt (every 10 ms: seconds, then as poses.txt). Every file appears complete or not at
/// all, and poses.txt last: a folder that has it has every scan. simulated.txt describes what was
/// simulated and marks the folder: scans that a longer run left in it are removed. The same
/// configuration gives the same bytes. Fails with kUsage iff a pose error is negative or not
/// finite, `out` or a folder below it cannot be made or be written to, it has a robot_K beyond the
/// configured number, or a robot_K has files but no mark, or a calib.txt or classes.toml; with
/// kFailure iff writing itself fails, as on a full disk.
Outcome<void> write_dataset(const StreetSimulator& simulator, const std::filesystem::path& out,
                            const DatasetWriterOptions& options);

}  // namespace tessera
