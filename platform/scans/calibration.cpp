// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/calibration.hpp"

#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>

#include "base/input_file.hpp"
#include "base/number_row.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {
namespace {

constexpr std::string_view kKey = "Tr:";

Outcome<Matrix34d> parse_transform(std::string_view numbers, const TextPlace& place) {
  const Outcome<Matrix34d> T_camera_lidar = parse_matrix34(numbers, place);
  if (T_camera_lidar.ok() && check_rigid(*T_camera_lidar) != Status::kOk) {
    return text_failure(place, "Tr is not a rigid transform",
                        "its left 3x3 part must be a rotation within 0.001, all numbers finite");
  }
  return T_camera_lidar;
}

}  // namespace

Outcome<Matrix34d> read_calibration(const std::string& path) {
  std::error_code error;
  if (std::filesystem::status(path, error).type() == std::filesystem::file_type::not_found) {
    return Matrix34d{Matrix34d::Identity()};
  }
  TESSERA_TRY_ASSIGN(const std::string content, read_text_file(path, kMostDescriptionBytes));

  std::optional<Matrix34d> T_camera_lidar;
  std::string_view text = content;
  for (TextPlace place{path, 1}; !text.empty(); ++place.line) {
    const std::string_view line = trimmed(take_line(text));
    if (!line.starts_with(kKey)) continue;
    if (T_camera_lidar) return text_failure(place, "a second Tr line", "keep one of them");
    TESSERA_TRY_ASSIGN(const Matrix34d parsed, parse_transform(line.substr(kKey.size()), place));
    T_camera_lidar = parsed;
  }
  if (T_camera_lidar) return *T_camera_lidar;
  return Failure{
      path +
      " has no line that starts with 'Tr:'; add it with the 12 numbers of the camera-from-"
      "LiDAR transform, or remove the file if the poses are in the LiDAR frame"};
}

}  // namespace tessera
