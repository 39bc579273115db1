// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "dataset/poses.hpp"

#include <string_view>

#include "dataset/number_row.hpp"
#include "posix/input_file.hpp"

namespace tessera {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{1} << 28U;

// Written out rather than left to Eigen, whose order of summation depends on the vector width of
// the build: the last bit of a pose decides about voxels, and so about the digest.
Matrix34d product(const Matrix34d& A, const Matrix34d& B) noexcept {
  Matrix34d result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      double sum = A(row, 0) * B(0, column) + A(row, 1) * B(1, column) + A(row, 2) * B(2, column);
      if (column == 3) sum += A(row, 3);
      result(row, column) = sum;
    }
  }
  return result;
}

// The inverse itself, not the transpose: a Tr that was printed with few digits is not quite a
// rotation, and the identity pose must still come out as the identity.
Matrix34d inverse(const Matrix34d& T) noexcept {
  const auto cofactor = [&T](int row, int column) {
    const int r1 = (row + 1) % 3;
    const int r2 = (row + 2) % 3;
    const int c1 = (column + 1) % 3;
    const int c2 = (column + 2) % 3;
    return T(r1, c1) * T(r2, c2) - T(r1, c2) * T(r2, c1);
  };
  const double determinant =
      T(0, 0) * cofactor(0, 0) + T(0, 1) * cofactor(0, 1) + T(0, 2) * cofactor(0, 2);
  Matrix34d result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      result(row, column) = cofactor(column, row) / determinant;
    }
    result(row, 3) =
        -(result(row, 0) * T(0, 3) + result(row, 1) * T(1, 3) + result(row, 2) * T(2, 3));
  }
  return result;
}

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
