// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/pose_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>

#include "base/input_file.hpp"
#include "base/number_row.hpp"
#include "scans/cloud.hpp"
#include "scans/poses.hpp"

namespace tessera {
namespace {

constexpr std::size_t kKitti = 12;
constexpr std::size_t kTum = 8;
constexpr std::size_t kSquare = 16;
constexpr std::string_view kForms =
    "write 12 (3x4, row by row), 16 (4x4) or 8 (stamp tx ty tz qx qy qz qw) in each";

struct Row {
  std::array<double, kSquare> numbers{};
  std::size_t count = 0;
};

Outcome<Row> parse_row(std::string_view line, const TextPlace& place) {
  Row row;
  for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
    double value = 0.0;
    if (!parse_double(word, value)) return not_a_number(place, printable(word), kForms);
    if (row.count < row.numbers.size()) row.numbers[row.count] = value;
    ++row.count;
  }
  if (row.count == kKitti || row.count == kTum || row.count == kSquare) return row;
  return text_failure(place, fmt::format("a pose has {} numbers", row.count), kForms);
}

/// numbers: tx ty tz qx qy qz qw, from a quaternion that need not be of unit length.
Matrix34d from_quaternion(std::span<const double, kTum - 1> numbers) {
  std::array<double, 4> q{numbers[3], numbers[4], numbers[5], numbers[6]};
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  // Printed with few digits it is near unit length; anything else is not a rotation and stays so.
  if (std::abs(length - 1.0) < 0.01) {
    for (double& part : q) part /= length;
  }
  const auto [x, y, z, w] = q;
  Matrix34d T;
  T << w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y), numbers[0],
      2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x), numbers[1],
      2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z, numbers[2];
  return T;
}

Outcome<Matrix34d> pose_of(const Row& row, const TextPlace& place) {
  if (row.count == kTum)
    return from_quaternion(std::span<const double, kTum - 1>(row.numbers.data() + 1, kTum - 1));
  constexpr std::array<double, 4> kLastRow{0.0, 0.0, 0.0, 1.0};
  if (row.count == kSquare &&
      !std::equal(kLastRow.begin(), kLastRow.end(), row.numbers.begin() + kKitti)) {
    return text_failure(place, "the last four of its 16 numbers are not 0 0 0 1",
                        "write the 4x4 matrix row by row");
  }
  Matrix34d T;
  std::copy_n(row.numbers.begin(), kKitti, T.data());
  return T;
}

}  // namespace

Outcome<PoseRows> read_pose_rows(const std::string& path) {
  TESSERA_TRY_ASSIGN(const std::string content, read_text_file(path, kMostRowsBytes));
  PoseRows rows;
  std::vector<Matrix34d>& poses = rows.T_map_sensor;
  // A digit and a blank for each number: growing instead would take three times the memory.
  poses.reserve(count_rows(content, 2 * kTum - 1));
  Row last;
  std::string_view text = content;
  for (TextPlace place{path, 1}; !text.empty(); ++place.line) {
    const std::string_view line = trimmed(take_line(text));
    if (line.empty() || line.front() == '#') continue;
    TESSERA_TRY_ASSIGN(const Row row, parse_row(line, place));
    if (!poses.empty() && row.count != last.count) {
      return text_failure(
          place,
          fmt::format("a pose has {} numbers, the ones before have {}", row.count, last.count),
          kForms);
    }
    // A NaN stamp is refused too.
    if (row.count == kTum && !poses.empty() && !(row.numbers[0] > last.numbers[0])) {
      return text_failure(place, "the stamp is not after that of the pose before",
                          "write the poses in the order of the scans");
    }
    TESSERA_TRY_ASSIGN(const Matrix34d pose, pose_of(row, place));
    poses.push_back(pose);
    if (row.count == kTum) {
      if (rows.stamps_s.empty()) rows.stamps_s.reserve(poses.capacity());
      rows.stamps_s.push_back(row.numbers[0]);
    }
    last = row;
  }
  TESSERA_TRY(check_some_rigid(path, poses));
  return rows;
}

}  // namespace tessera
