// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/pose_assembly.hpp"

#include <algorithm>
#include <cmath>

#include "vehicle/bus_messages.hpp"

namespace tessera {
namespace {

constexpr unsigned kAllParts = 7;

/// Reads values, and checks that all of them are in their ranges.
class RangedReader {
 public:
  explicit RangedReader(std::span<const std::uint8_t> data) noexcept : data_(data) {}
  double operator()(const Signal& signal) noexcept {
    const double value = value_of(data_, signal);
    all_in_range_ = all_in_range_ && in_range(signal, value);
    return value;
  }
  [[nodiscard]] bool all_in_range() const noexcept { return all_in_range_; }

 private:
  std::span<const std::uint8_t> data_;
  bool all_in_range_ = true;
};

}  // namespace

Matrix34d to_transform(const SentPose& pose) noexcept {
  const double ch = std::cos(pose.heading_rad);
  const double sh = std::sin(pose.heading_rad);
  const double cp = std::cos(pose.pitch_rad);
  const double sp = std::sin(pose.pitch_rad);
  const double cr = std::cos(pose.roll_rad);
  const double sr = std::sin(pose.roll_rad);
  Matrix34d T;
  T << ch * cp, ch * sp * sr - sh * cr, ch * sp * cr + sh * sr, pose.p_map.x(),  //
      sh * cp, sh * sp * sr + ch * cr, sh * sp * cr - ch * sr, pose.p_map.y(),   //
      -sp, cp * sr, cp * cr, pose.p_map.z();
  return T;
}

std::optional<SentPose> read_fd_pose(std::span<const std::uint8_t> data) noexcept {
  if (raw_of(data, bus::kFdPoseState) != 1) return std::nullopt;
  RangedReader read(data);
  SentPose pose;
  pose.p_map.x() = read(bus::kFdX);
  pose.p_map.y() = read(bus::kFdY);
  pose.p_map.z() = read(bus::kFdZ);
  pose.roll_rad = read(bus::kFdRoll);
  pose.pitch_rad = read(bus::kFdPitch);
  pose.heading_rad = read(bus::kFdHeading);
  const double std_x = read(bus::kFdStdX);
  const double std_y = read(bus::kFdStdY);
  const double std_z = read(bus::kFdStdZ);
  pose.std_position_m = std::max({std_x, std_y, std_z});
  const double std_roll = read(bus::kFdStdRoll);
  const double std_pitch = read(bus::kFdStdPitch);
  const double std_heading = read(bus::kFdStdHeading);
  pose.std_heading_rad = std::max({std_roll, std_pitch, std_heading});
  pose.age_ms = read(bus::kFdAge);
  if (!read.all_in_range()) return std::nullopt;
  return pose;
}

std::optional<PoseAssembly::Whole> PoseAssembly::take(Part part, std::span<const std::uint8_t> data,
                                                      std::int64_t received_us) noexcept {
  const std::uint32_t counter = raw_of(data, bus::kPoseCounter);
  const unsigned bit = 1U << static_cast<unsigned>(part);
  const bool late = received_us - first_received_us_ > kMaxSpreadUs;
  if (parts_ != 0 && (counter != counter_ || late || (parts_ & bit) != 0)) {
    ++incomplete_;
    parts_ = 0;
  }
  if (parts_ == 0) {
    counter_ = counter;
    first_received_us_ = received_us;
    in_range_ = true;
  }
  RangedReader read(data);
  switch (part) {
    case Part::kXy:
      pose_.p_map.x() = read(bus::kX);
      pose_.p_map.y() = read(bus::kY);
      break;
    case Part::kZh:
      pose_.p_map.z() = read(bus::kZ);
      pose_.heading_rad = read(bus::kHeading);
      pose_.age_ms = read(bus::kAge);  // The code for "no pose" is out of range.
      break;
    case Part::kRp:
      pose_.roll_rad = read(bus::kRoll);
      pose_.pitch_rad = read(bus::kPitch);
      pose_.std_position_m = read(bus::kStdPosition);
      pose_.std_heading_rad = read(bus::kStdHeading);
      break;
  }
  in_range_ = in_range_ && read.all_in_range();
  parts_ |= bit;
  if (parts_ != kAllParts) return std::nullopt;
  parts_ = 0;
  return Whole{pose_, first_received_us_, in_range_};
}

}  // namespace tessera
