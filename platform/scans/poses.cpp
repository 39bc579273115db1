// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/poses.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>

#include "base/input_file.hpp"
#include "base/number_row.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

Outcome<std::vector<Matrix34d>> read_poses(const std::string& path) {
  TESSERA_TRY_ASSIGN(const std::string content, read_text_file(path, kMostRowsBytes));
  std::vector<Matrix34d> poses;
  // A digit and a blank for each number: growing instead would take three times the memory.
  constexpr std::size_t kFewestRowBytes = 23;
  poses.reserve(count_rows(content, kFewestRowBytes));
  std::string_view text = content;
  for (TextPlace place{path, 1}; !text.empty(); ++place.line) {
    const std::string_view line = trimmed(take_line(text));
    if (line.empty()) continue;
    TESSERA_TRY_ASSIGN(const Matrix34d pose, parse_matrix34(line, place));
    poses.push_back(pose);
  }
  TESSERA_TRY(check_some_rigid(path, poses));
  return poses;
}

Outcome<void> check_some_rigid(const std::string& path, const std::vector<Matrix34d>& poses) {
  const auto is_rigid = [](const Matrix34d& pose) { return check_rigid(pose) == Status::kOk; };
  if (poses.empty() || std::any_of(poses.begin(), poses.end(), is_rigid)) return {};
  return Failure{
      fmt::format("{}: none of its {} poses is a rigid transform; check that they are finite, with "
                  "the rotation row by row and before the translation, and without a scale",
                  path, poses.size())};
}

Matrix34d lidar_pose(const Matrix34d& T_camera_lidar, const Matrix34d& T_world_camera) noexcept {
  return product(inverse(T_camera_lidar), product(T_world_camera, T_camera_lidar));
}

}  // namespace tessera
