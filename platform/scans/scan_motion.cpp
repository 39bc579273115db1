// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/scan_motion.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "base/input_file.hpp"
#include "base/number_row.hpp"
#include "scans/poses.hpp"
#include "settings/source_options.hpp"

namespace tessera {
namespace {

/// 285,000 years, so that microseconds and their differences fit.
constexpr double kMostSeconds = 9e12;

Outcome<std::int64_t> take_stamp(std::string_view& row, const TextPlace& place) {
  const std::string_view word = take_word(row);
  double seconds = 0.0;
  if (!parse_double(word, seconds) || !(std::abs(seconds) <= kMostSeconds))
    return not_a_number(place, word, "write the seconds of the stamp");
  return static_cast<std::int64_t>(std::llround(seconds * 1e6));
}

/// Calls add(row, place), which returns an Outcome<void>, for every line that is not blank.
template <class Add>
Outcome<void> for_rows(const std::string& path, Add&& add) {
  TESSERA_TRY_ASSIGN(const std::string content, read_text_file(path, kMostRowsBytes));
  std::string_view text = content;
  for (TextPlace place{path, 1}; !text.empty(); ++place.line) {
    const std::string_view line = trimmed(take_line(text));
    if (line.empty()) continue;
    TESSERA_TRY(add(line, place));
  }
  return {};
}

Outcome<std::vector<StampedPose>> read_dense(const std::string& path,
                                             const Matrix34d& T_camera_lidar) {
  std::vector<StampedPose> poses;
  const Outcome<void> read = for_rows(path, [&](std::string_view row, const TextPlace& place) {
    const Outcome<std::int64_t> stamp_us = take_stamp(row, place);
    if (!stamp_us.ok()) return Outcome<void>(stamp_us.failure());
    const Outcome<Matrix34d> pose = parse_matrix34(row, place);
    if (!pose.ok()) return Outcome<void>(pose.failure());
    if (!poses.empty() && *stamp_us <= poses.back().stamp_us)
      return Outcome<void>(text_failure(place, "this stamp is not later than the one before",
                                        "sort the poses and keep one per stamp"));
    poses.push_back({*stamp_us, lidar_pose(T_camera_lidar, *pose)});
    return Outcome<void>();
  });
  if (!read.ok()) return read.failure();
  return poses;
}

}  // namespace

Outcome<std::vector<std::int64_t>> read_times(const std::string& path) {
  std::vector<std::int64_t> stamps_us;
  const Outcome<void> read = for_rows(path, [&](std::string_view row, const TextPlace& place) {
    const Outcome<std::int64_t> stamp_us = take_stamp(row, place);
    if (!stamp_us.ok()) return Outcome<void>(stamp_us.failure());
    if (!trimmed(row).empty())
      return Outcome<void>(text_failure(place, "more than one number",
                                        "write one line per scan with the seconds of its stamp"));
    if (!stamps_us.empty() && *stamp_us <= stamps_us.back())
      return Outcome<void>(text_failure(place, "this stamp is not later than the one before",
                                        "write the stamps of the scans in their order"));
    stamps_us.push_back(*stamp_us);
    return Outcome<void>();
  });
  if (!read.ok()) return read.failure();
  return stamps_us;
}

Outcome<void> ScanMotion::fill(const std::vector<StampedPose>& poses, const std::string& path) {
  if (poses.size() > PoseTrack::kMostPoses)
    return Failure{path + " has over a million poses; split the sequence"};
  const std::size_t capacity = std::max<std::size_t>(poses.size(), 1);
  memory_ = ArenaMemory(PoseTrack::required_bytes(capacity));
  Arena arena(memory_.span());
  Result<PoseTrack> track = PoseTrack::make(capacity, arena);
  if (!track.ok()) return Failure{"no memory for the poses of " + path, FailureKind::kFailure};
  track_ = *track;
  for (const StampedPose& pose : poses) static_cast<void>(track_.add(pose));
  return {};
}

Outcome<ScanMotion> ScanMotion::load(const std::string& dir, const KnownPoses& poses,
                                     std::size_t num_scans) {
  const std::filesystem::path folder(dir);
  const std::string times = (folder / "times.txt").string();
  std::error_code error;
  if (!std::filesystem::exists(times, error))
    return Failure{times +
                   " does not exist; correcting motion needs the "
                   "seconds of each scan, one per line"};
  TESSERA_TRY_ASSIGN(std::vector<std::int64_t> stamps_us, read_times(times));
  if (stamps_us.size() < num_scans)
    return Failure{
        fmt::format("{} has {} stamps, but the chosen scans need {}; add the missing rows or "
                    "choose fewer scans with ",
                    times, stamps_us.size(), num_scans) +
        kSourceSettings["--last"]};
  ScanMotion motion;
  motion.stamps_us_ = std::move(stamps_us);
  std::string path = (folder / "poses_dense.txt").string();
  std::vector<StampedPose> stamped;
  if (std::filesystem::exists(path, error)) {
    TESSERA_TRY_ASSIGN(std::vector<StampedPose> dense, read_dense(path, poses.T_camera_lidar));
    stamped = std::move(dense);
  } else {
    path = (folder / "poses.txt").string();
    const std::size_t count = std::min(poses.T_map_sensor.size(), motion.stamps_us_.size());
    for (std::size_t i = 0; i < count; ++i)
      stamped.push_back({motion.stamps_us_[i], poses.T_map_sensor[i]});
  }
  TESSERA_TRY(motion.fill(stamped, path));
  return motion;
}

std::optional<ScanMotion> ScanMotion::of(const PoseRows& rows) {
  if (rows.stamps_s.empty() || rows.stamps_s.size() > PoseTrack::kMostPoses) return {};
  ScanMotion motion;
  std::vector<StampedPose> stamped;
  for (std::size_t i = 0; i < rows.stamps_s.size(); ++i) {
    if (!(std::abs(rows.stamps_s[i]) <= kMostSeconds)) return {};
    const std::int64_t stamp_us = std::llround(rows.stamps_s[i] * 1e6);
    if (i > 0 && stamp_us <= motion.stamps_us_.back()) return {};
    motion.stamps_us_.push_back(stamp_us);
    stamped.push_back({stamp_us, rows.T_map_sensor[i]});
  }
  if (!motion.fill(stamped, "the poses").ok()) return {};
  return motion;
}

}  // namespace tessera
