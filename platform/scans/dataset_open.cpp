// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Opens a dataset: makes all checks that need only names, sizes and the small text files.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "scans/calibration.hpp"
#include "scans/camera_images.hpp"
#include "scans/dataset.hpp"
#include "scans/poses.hpp"
#include "scans/scan_listing.hpp"

namespace tessera {
namespace {

constexpr std::uint64_t kBytesPerPoint = 16;
constexpr std::uint64_t kMaxPointsPerScan = std::uint64_t{1} << 24U;

Outcome<void> require_folder(const std::string& what, const std::string& path,
                             const Message& remedy) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) return {};
  std::string message = "the " + what + " " + path;
  message.append(std::filesystem::exists(status) ? " is not a folder; " : " does not exist; ");
  return Failure{message + remedy};
}

Failure no_scan_in(ScanRange range, const std::vector<int>& found, const std::string& folder) {
  return {fmt::format("there is no scan from {} to {} in {}, it has numbers from {} to {}",
                      range.first, range.last, folder, found.front(), found.back()) +
          choose_scans()};
}

}  // namespace

Deskewing deskewing(std::optional<bool> on) noexcept {
  if (!on) return Deskewing::kWhereTimed;
  return *on ? Deskewing::kOn : Deskewing::kOff;
}

Outcome<Dataset> Dataset::open(const std::string& dir, const DatasetOptions& options) {
  TESSERA_TRY(require_folder("dataset folder", dir, "check the name"));
  TESSERA_TRY_ASSIGN(DatasetClasses classes, DatasetClasses::load(dir));

  Dataset dataset(dir, std::move(classes), options.labels);
  TESSERA_TRY(dataset.choose_scans(options));
  std::error_code error;
  const bool timed = std::filesystem::is_directory(in_folder(dir, "times"), error);
  dataset.deskews_ =
      options.deskew == Deskewing::kOn || (options.deskew == Deskewing::kWhereTimed && timed);
  dataset.has_times_ = dataset.deskews_ || (options.with_times && timed);
  dataset.wants_motion_ =
      options.with_motion && std::filesystem::exists(in_folder(dir, "times.txt"), error);
  if (options.labels == kCameraLabels || (options.with_images && has_cameras(dir))) {
    TESSERA_TRY_ASSIGN(std::vector<CameraDescription> cameras, open_cameras(dir));
    dataset.cameras_ = std::move(cameras);
  }
  for (const auto step : {&Dataset::attach_poses, &Dataset::measure_scans, &Dataset::check_times,
                          &Dataset::check_cameras}) {
    TESSERA_TRY((dataset.*step)());
  }
  if (dataset.has_labels()) {
    TESSERA_TRY_ASSIGN(
        dataset.weighted_labels_,
        dataset.check_label_files(dataset.labels_, "name another folder with " +
                                                       kSourceSettings["--labels"] + ", or give " +
                                                       kSourceSettings["--labels"] + " none"));
  }
  return dataset;
}

Outcome<void> Dataset::choose_scans(const DatasetOptions& options) {
  const std::string folder = in_folder(dir_, "velodyne");
  TESSERA_TRY(require_folder("scan folder", folder,
                             "a dataset needs velodyne/000000.bin, velodyne/000001.bin, ..."));
  if (options.first.value_or(0) < 0 || options.last.value_or(0) < 0) {
    return Failure{"a scan number is negative; give numbers from 0 on"};
  }
  if (options.first && options.last && *options.first > *options.last) {
    return Failure{Message(kSourceSettings["--first"]) + " " + std::to_string(*options.first) +
                   " is after " + kSourceSettings["--last"] + " " + std::to_string(*options.last) +
                   "; swap them"};
  }
  TESSERA_TRY_ASSIGN(const std::vector<int> found, list_scans(folder));
  const ScanRange range{options.first.value_or(found.front()),
                        options.last.value_or(std::max(found.back(), options.first.value_or(0)))};
  for (const int number : found) {
    if (number >= range.first && number <= range.last) scans_.push_back({.number = number});
  }
  if (scans_.empty()) return no_scan_in(range, found, folder);
  missing_ = missing_scans(found, {range.first, std::min(range.last, kMaxScanNumber)});
  return {};
}

Outcome<void> Dataset::measure_scans() {
  for (Entry& scan : scans_) {
    const ScanFilePath path(dir_, "velodyne", scan.number, ".bin");
    TESSERA_TRY_ASSIGN(const std::uint64_t size, file_size_bytes(path));
    if (size % kBytesPerPoint != 0) {
      return Failure{
          fmt::format("{} has {} bytes, not a multiple of the 16 that a point takes; it is "
                      "truncated, get a complete copy",
                      path.view(), size)};
    }
    if (size / kBytesPerPoint > kMaxPointsPerScan) {
      return Failure{fmt::format("{} has {} points, the limit is {}; split it into several scans",
                                 path.view(), size / kBytesPerPoint, kMaxPointsPerScan)};
    }
    scan.points = static_cast<std::size_t>(size / kBytesPerPoint);
    max_points_ = std::max(max_points_, scan.points);
  }
  return {};
}

Outcome<void> Dataset::attach_poses() {
  const std::string path = in_folder(dir_, "poses.txt");
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return Failure{
        path + " does not exist; a dataset needs it, with the 12 numbers of a pose for each scan"};
  }
  TESSERA_TRY_ASSIGN(const Matrix34d T_camera_lidar,
                     read_calibration(in_folder(dir_, "calib.txt")));
  TESSERA_TRY_ASSIGN(const std::vector<Matrix34d> poses, read_poses(path));

  const auto needed = static_cast<std::size_t>(scans_.back().number) + 1;
  if (poses.size() < needed) {
    return Failure{
        fmt::format("{} has {} poses, but the {} chosen scans go up to number {} and need {}; add "
                    "the missing rows or choose fewer scans with ",
                    path, poses.size(), scans_.size(), scans_.back().number, needed) +
        kSourceSettings["--last"]};
  }
  for (Entry& scan : scans_) {
    scan.T_map_sensor = lidar_pose(T_camera_lidar, poses[static_cast<std::size_t>(scan.number)]);
  }
  const auto is_offset = [](const CameraDescription& camera) { return camera.offset_us != 0; };
  const bool needs_motion = deskews_ || (labels_ == kCameraLabels &&
                                         std::any_of(cameras_.begin(), cameras_.end(), is_offset));
  if (!needs_motion && !wants_motion_) return {};
  std::vector<Matrix34d> T_map_sensor;
  for (const Matrix34d& pose : poses) T_map_sensor.push_back(lidar_pose(T_camera_lidar, pose));
  TESSERA_TRY_ASSIGN(
      ScanMotion motion,
      ScanMotion::load(dir_, {.T_map_sensor = T_map_sensor, .T_camera_lidar = T_camera_lidar},
                       needed));
  motion_ = std::move(motion);
  return {};
}

Outcome<void> Dataset::check_times() {
  if (!has_times_) return {};
  TESSERA_TRY(require_folder(
      "folder of times", in_folder(dir_, "times"),
      "get the times of the points, or give " + kSourceSettings["--deskew"] + " off"));
  for (const Entry& scan : scans_) {
    const ScanFilePath path(dir_, "times", scan.number, ".bin");
    TESSERA_TRY_ASSIGN(const std::uint64_t size, file_size_bytes(path));
    if (size == scan.points * sizeof(float)) continue;
    return Failure{
        fmt::format("{} has {} bytes, but its scan has {} points of 4 each; get the times that "
                    "belong to this scan, or give ",
                    path.view(), size, scan.points) +
        kSourceSettings["--deskew"] + " off"};
  }
  return {};
}

Outcome<void> Dataset::check_cameras() {
  std::vector<int> numbers;
  for (const Entry& scan : scans_) numbers.push_back(scan.number);
  return check_images(dir_, cameras_, numbers);
}

Outcome<void> Dataset::check_labels(const std::string& folder) const {
  TESSERA_TRY_ASSIGN(const std::size_t labels,
                     check_label_files(folder, "name a folder of labels that exists"));
  static_cast<void>(labels);
  return {};
}

Outcome<std::size_t> Dataset::check_label_files(const std::string& folder,
                                                const Message& remedy) const {
  if (folder.empty()) return Failure{"the label folder has no name; " + remedy};
  TESSERA_TRY(require_folder("label folder", in_folder(dir_, folder), remedy));
  std::size_t labels = 0;
  const Entry* compared = nullptr;  // The last scan with points.
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    TESSERA_TRY_ASSIGN(const std::size_t here, check_label_file(label_file(i, folder)));
    if (scans_[i].points == 0) continue;
    if (compared != nullptr && here != labels) {
      return Failure{fmt::format(
          "the label folder {} has {} with weights for each point of scan {}, and {} of scan {}; "
          "label all scans alike",
          in_folder(dir_, folder), labels, compared->number, here, scans_[i].number)};
    }
    labels = here;
    compared = &scans_[i];
  }
  return labels;
}

}  // namespace tessera
