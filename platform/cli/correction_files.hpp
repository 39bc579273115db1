// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Files of corrected poses, as --corrections names them.
#pragma once

#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "scans/pose_file.hpp"
#include "settings/source_options.hpp"

namespace tessera {

/// A row for each of the first scans, or rows with stamps.
struct CorrectionFile {
  std::string path;
  PoseRows rows;
};

/// Poses of a dataset are of its camera, as in its poses.txt, and become those of the LiDAR. Fails
/// with kUsage iff a file is none of poses, or the dataset has no calibration.
Outcome<std::vector<CorrectionFile>> read_corrections(const std::vector<std::string>& paths,
                                                      const SourceOptions& source);

}  // namespace tessera
