// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/poses.hpp"

#include <algorithm>
#include <string_view>

#include "base/input_file.hpp"
#include "base/number_row.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

Outcome<std::vector<Matrix34d>> read_poses(const std::string& path) {
  const Outcome<std::string> content = read_text_file(path, kMostRowsBytes);
  if (!content.ok()) return content.failure();
  std::vector<Matrix34d> poses;
  // A digit and a blank for each number: growing instead would take three times the memory.
  constexpr std::size_t kFewestRowBytes = 23;
  poses.reserve(count_rows(*content, kFewestRowBytes));
  std::string_view text = *content;
  for (TextPlace place{path, 1}; !text.empty(); ++place.line) {
    const std::string_view line = trimmed(take_line(text));
    if (line.empty()) continue;
    const Outcome<Matrix34d> pose = parse_matrix34(line, place);
    if (!pose.ok()) return pose.failure();
    poses.push_back(*pose);
  }
  const Outcome<void> usable = check_some_rigid(path, poses);
  if (!usable.ok()) return usable.failure();
  return poses;
}

Outcome<void> check_some_rigid(const std::string& path, const std::vector<Matrix34d>& poses) {
  const auto is_rigid = [](const Matrix34d& pose) { return check_rigid(pose) == Status::kOk; };
  if (poses.empty() || std::any_of(poses.begin(), poses.end(), is_rigid)) return {};
  return Failure{path + ": none of its " + std::to_string(poses.size()) +
                 " poses is a rigid transform; check that they are finite, with the rotation row "
                 "by row and before the translation, and without a scale"};
}

Matrix34d lidar_pose(const Matrix34d& T_camera_lidar, const Matrix34d& T_world_camera) noexcept {
  return product(inverse(T_camera_lidar), product(T_world_camera, T_camera_lidar));
}

}  // namespace tessera
