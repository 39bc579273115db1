// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"
#include "scans/pose_file.hpp"

namespace tessera {

/// Which files of a folder, and the poses that they have.
struct FileChoice {
  std::string_view folder;
  std::string_view kind;  ///< ".pcd", for refusals.
  std::string_view poses;
  std::optional<int> first{};
  std::optional<int> last{};
};

/// A file of a folder with its row of the poses.
struct PosedFile {
  int number = 0;  ///< From 0, in the order of the files.
  std::string path;
  Matrix34d T_map_sensor = Matrix34d::Identity();
};

/// The chosen ones of a folder's files, given in their order: row i is of file i. Fails with kUsage
/// iff a number is negative, none is chosen, or there is no row for one of them.
[[nodiscard]] Outcome<std::vector<PosedFile>> choose_files(const FileChoice& choice,
                                                           const std::vector<std::string>& paths,
                                                           const PoseRows& poses);

}  // namespace tessera
