// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "dataset/poses.hpp"

#include <string_view>

#include "dataset/number_row.hpp"
#include "posix/input_file.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{1} << 28U;

}  // namespace

Outcome<std::vector<Matrix34d>> read_poses(const std::string& path) {
  const Outcome<std::string> content = read_text_file(path, kMaxTextBytes);
  if (!content.ok()) return content.failure();
  std::vector<Matrix34d> poses;
  std::string_view text = *content;
  for (TextPlace place{path, 1}; !text.empty(); ++place.line) {
    const std::string_view line = trimmed(take_line(text));
    if (line.empty()) continue;
    const Outcome<Matrix34d> pose = parse_matrix34(line, place);
    if (!pose.ok()) return pose.failure();
    poses.push_back(*pose);
  }
  return poses;
}

Matrix34d lidar_pose(const Matrix34d& T_camera_lidar, const Matrix34d& T_world_camera) noexcept {
  return product(inverse(T_camera_lidar), product(T_world_camera, T_camera_lidar));
}

}  // namespace tessera
