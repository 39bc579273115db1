// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <map>

#include "soak/soak.hpp"

namespace tessera::soak {

namespace {

constexpr double kCorrected_m = 0.03;  ///< Noise of a submap's corrected place and heading.
constexpr double kCorrected_rad = 0.001;

}  // namespace

/// What a pose graph finds when a loop is closed: the truth, but for a little. As poses or as
/// frames.
void Soak::correct(Robot& robot) {
  Member& member = robot.member;
  const MappedMap& map = logbook_.current(member.number());
  const FlatPose T_map_global = inverse(member.T_global_map());
  street::Random draw(
      street::hash_of(options_.seed, street::Stream::kMistake, member.number(), robot.scans));
  const bool as_poses = draw.chance(0.5);
  std::map<std::int64_t, FlatPose> poses;  // A start may have gone back to an earlier submap.
  std::vector<std::uint32_t> submaps;
  std::vector<double> transforms;
  const auto put = [&](const FlatPose& pose) {
    const Matrix34d T = matrix_of(pose);
    for (int k = 0; k < 12; ++k) transforms.push_back(T(k / 4, k % 4));
  };
  for (const auto& [number, submap] : map.submaps) {
    const FlatPose noise{kCorrected_m * draw.gaussian(), kCorrected_m * draw.gaussian(),
                         kCorrected_m * draw.gaussian(), kCorrected_rad * draw.gaussian()};
    const auto corrected = [&](const MappedScan& scan) {
      return product(T_map_global, product(scan.T_world_sensor, noise));
    };
    // A kill may have taken all scans of the last submap, and itself with them.
    if (!member.robot().sharer().frames().has(number) || submap.scans.empty()) continue;
    for (const MappedScan& scan : submap.scans) poses[scan.stamp_us] = corrected(scan);
    if (as_poses) continue;
    const MappedScan& middle = submap.scans[submap.scans.size() / 2];
    submaps.push_back(number);
    put(product(corrected(middle), inverse(middle.T_map_sensor)));
  }
  std::vector<std::int64_t> stamps;
  for (const auto& [stamp_us, pose] : poses) {
    stamps.push_back(stamp_us);
    if (as_poses) put(pose);
  }
  const CorrectionReport report = as_poses ? member.correct(CorrectedTrajectory{stamps, transforms})
                                           : member.correct(CorrectedFrames{submaps, transforms});
  if (report.status != Status::kOk) report_fault("a correction was refused");
  ++totals_.corrections;
}

}  // namespace tessera::soak
