// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "simulator/dataset_formats.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstddef>
#include <iterator>
#include <span>

namespace tessera::street {
namespace {

std::string list_of(std::span<const double> numbers) {
  std::string text = "[";
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0) text += ", ";
    text += text_of(numbers[i]);
  }
  return text + ']';
}

std::string entry(const SimulatedCamera& camera, std::size_t number) {
  const CameraIntrinsics& c = camera.model.intrinsics();
  const bool fisheye = c.kind == CameraKind::kFisheye;
  const std::size_t distortions = fisheye ? 4 : 5;
  const double focal[] = {c.focal_x_px, c.focal_y_px};
  const double centre[] = {c.centre_x_px, c.centre_y_px};
  std::vector<double> T;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column)
      T.push_back(camera.T_camera_sensor.matrix()(row, column));
  }
  std::string text = "\n[[camera]]\n";
  text += "name = \"" + camera.name + "\"\n";
  text += fmt::format("folder = \"cameras/{}\"\n", number);
  text += std::string("model = \"") + (fisheye ? "fisheye" : "pinhole") + "\"\n";
  text += fmt::format("width = {}\n", c.width_px);
  text += fmt::format("height = {}\n", c.height_px);
  text += "focal = " + list_of(focal) + "\n";
  text += "centre = " + list_of(centre) + "\n";
  text += "distortion = " + list_of(std::span(c.distortion).first(distortions)) + "\n";
  text += "T_camera_lidar = " + list_of(T) + "\n";
  text += "stamp_offset = " + text_of(camera.offset_s) + "\n";
  return text;
}

void put_u32(std::string& out, std::uint32_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8)
    out.push_back(static_cast<char>((value >> shift) & 0xffU));
}

}  // namespace

std::string point_bytes(const std::vector<std::array<float, 4>>& points) {
  std::string bytes;
  bytes.reserve(points.size() * 16);
  for (const auto& point : points) {
    for (const float number : point) put_u32(bytes, std::bit_cast<std::uint32_t>(number));
  }
  return bytes;
}

std::string number_bytes(const std::vector<float>& numbers) {
  std::string bytes;
  bytes.reserve(numbers.size() * 4);
  for (const float number : numbers) put_u32(bytes, std::bit_cast<std::uint32_t>(number));
  return bytes;
}

std::string label_bytes(const std::vector<std::uint32_t>& labels) {
  std::string bytes;
  bytes.reserve(labels.size() * 4);
  for (const std::uint32_t label : labels) put_u32(bytes, label);
  return bytes;
}

std::string scan_name(int index) {
  const std::string digits = std::to_string(index);
  return std::string(6 - std::min<std::size_t>(digits.size(), 6), '0') + digits;
}

std::string text_of(double number) {
  char digits[32];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), number).ptr;
  return {std::begin(digits), end};
}

std::string rows_text(const Eigen::Isometry3d& pose, int rows, char between_rows) {
  std::string text;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < 4; ++column) {
      if (column > 0) text += ' ';
      text += text_of(pose.matrix()(row, column));
    }
    text += row + 1 < rows ? between_rows : '\n';
  }
  return text;
}

std::string cameras_toml(const std::vector<SimulatedCamera>& cameras) {
  std::string text =
      "# focal, centre: pixels, x then y. distortion: k1 k2 p1 p2 k3 of a pinhole, k1 k2 k3 k4 of "
      "a\n"
      "# fisheye. T_camera_lidar: 3x4 by rows, metres, camera x right, y down, z forward.\n"
      "# stamp_offset: seconds from the scan's stamp to the image's.\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) text += entry(cameras[i], i);
  return text;
}

}  // namespace tessera::street
