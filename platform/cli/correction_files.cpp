// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/correction_files.hpp"

#include "scans/calibration.hpp"
#include "scans/poses.hpp"

namespace tessera {

Outcome<std::vector<CorrectionFile>> read_corrections(const std::vector<std::string>& paths,
                                                      const SourceOptions& source) {
  std::vector<CorrectionFile> files;
  for (const std::string& path : paths) {
    TESSERA_TRY_ASSIGN(PoseRows rows, read_pose_rows(path));
    if (rows.T_map_sensor.empty()) return Failure{path + " has no pose; give a row for each scan"};
    if (rows.stamps_s.empty() && source.folder() == source.dataset) {
      TESSERA_TRY_ASSIGN(const Matrix34d T_camera_lidar,
                         read_calibration(source.dataset + "/calib.txt"));
      for (Matrix34d& pose : rows.T_map_sensor) pose = lidar_pose(T_camera_lidar, pose);
    }
    files.push_back({path, std::move(rows)});
  }
  return files;
}

}  // namespace tessera
