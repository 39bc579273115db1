// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Opens a dataset: makes all checks that need only names, sizes and the small text files.
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
constexpr std::uint64_t kBytesPerLabel = 4;
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
  return {"there is no scan from " + std::to_string(range.first) + " to " +
          std::to_string(range.last) + " in " + folder + ", it has numbers from " +
          std::to_string(found.front()) + " to " + std::to_string(found.back()) + choose_scans()};
}

}  // namespace

Deskewing deskewing(std::optional<bool> on) noexcept {
  if (!on) return Deskewing::kWhereTimed;
  return *on ? Deskewing::kOn : Deskewing::kOff;
}

Outcome<Dataset> Dataset::open(const std::string& dir, const DatasetOptions& options) {
  const Outcome<void> folder = require_folder("dataset folder", dir, "check the name");
  if (!folder.ok()) return folder.failure();
  Outcome<DatasetClasses> classes = DatasetClasses::load(dir);
  if (!classes.ok()) return classes.failure();

  Dataset dataset(dir, std::move(*classes), options.labels);
  const Outcome<void> chosen = dataset.choose_scans(options);
  if (!chosen.ok()) return chosen.failure();
  std::error_code error;
  const bool timed = std::filesystem::is_directory(in_folder(dir, "times"), error);
  dataset.deskews_ =
      options.deskew == Deskewing::kOn || (options.deskew == Deskewing::kWhereTimed && timed);
  dataset.has_times_ = dataset.deskews_ || (options.with_times && timed);
  dataset.wants_motion_ =
      options.with_motion && std::filesystem::exists(in_folder(dir, "times.txt"), error);
  if (options.labels == kCameraLabels || (options.with_images && has_cameras(dir))) {
    Outcome<std::vector<CameraDescription>> cameras = open_cameras(dir);
    if (!cameras.ok()) return cameras.failure();
    dataset.cameras_ = std::move(*cameras);
  }
  for (const auto step : {&Dataset::attach_poses, &Dataset::measure_scans, &Dataset::check_times,
                          &Dataset::check_cameras}) {
    const Outcome<void> done = (dataset.*step)();
    if (!done.ok()) return done.failure();
  }
  if (dataset.has_labels()) {
    const Outcome<void> labels = dataset.check_label_files(
        dataset.labels_, "name another folder with " + kSourceSettings["--labels"] + ", or give " +
                             kSourceSettings["--labels"] + " none");
    if (!labels.ok()) return labels.failure();
  }
  return dataset;
}

Outcome<void> Dataset::choose_scans(const DatasetOptions& options) {
  const std::string folder = in_folder(dir_, "velodyne");
  const Outcome<void> present = require_folder(
      "scan folder", folder, "a dataset needs velodyne/000000.bin, velodyne/000001.bin, ...");
  if (!present.ok()) return present.failure();
  if (options.first.value_or(0) < 0 || options.last.value_or(0) < 0) {
    return Failure{"a scan number is negative; give numbers from 0 on"};
  }
  if (options.first && options.last && *options.first > *options.last) {
    return Failure{Message(kSourceSettings["--first"]) + " " + std::to_string(*options.first) +
                   " is after " + kSourceSettings["--last"] + " " + std::to_string(*options.last) +
                   "; swap them"};
  }
  const Outcome<std::vector<int>> found = list_scans(folder);
  if (!found.ok()) return found.failure();
  const ScanRange range{options.first.value_or(found->front()),
                        options.last.value_or(std::max(found->back(), options.first.value_or(0)))};
  for (const int number : *found) {
    if (number >= range.first && number <= range.last) scans_.push_back({.number = number});
  }
  if (scans_.empty()) return no_scan_in(range, *found, folder);
  missing_ = missing_scans(*found, {range.first, std::min(range.last, kMaxScanNumber)});
  return {};
}

Outcome<void> Dataset::measure_scans() {
  for (Entry& scan : scans_) {
    const ScanFilePath path(dir_, "velodyne", scan.number, ".bin");
    const Outcome<std::uint64_t> size = file_size_bytes(path);
    if (!size.ok()) return size.failure();
    if (*size % kBytesPerPoint != 0) {
      return Failure{std::string(path.view()) + " has " + std::to_string(*size) +
                     " bytes, not a multiple of the 16 that a point takes; it is truncated, get a "
                     "complete copy"};
    }
    if (*size / kBytesPerPoint > kMaxPointsPerScan) {
      return Failure{std::string(path.view()) + " has " + std::to_string(*size / kBytesPerPoint) +
                     " points, the limit is " + std::to_string(kMaxPointsPerScan) +
                     "; split it into several scans"};
    }
    scan.points = static_cast<std::size_t>(*size / kBytesPerPoint);
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
  const Outcome<Matrix34d> T_camera_lidar = read_calibration(in_folder(dir_, "calib.txt"));
  if (!T_camera_lidar.ok()) return T_camera_lidar.failure();
  const Outcome<std::vector<Matrix34d>> poses = read_poses(path);
  if (!poses.ok()) return poses.failure();

  const auto needed = static_cast<std::size_t>(scans_.back().number) + 1;
  if (poses->size() < needed) {
    return Failure{path + " has " + std::to_string(poses->size()) + " poses, but the " +
                   std::to_string(scans_.size()) + " chosen scans go up to number " +
                   std::to_string(scans_.back().number) + " and need " + std::to_string(needed) +
                   "; add the missing rows or choose fewer scans with " +
                   kSourceSettings["--last"]};
  }
  for (Entry& scan : scans_) {
    scan.T_map_sensor =
        lidar_pose(*T_camera_lidar, (*poses)[static_cast<std::size_t>(scan.number)]);
  }
  const auto is_offset = [](const CameraDescription& camera) { return camera.offset_us != 0; };
  const bool needs_motion = deskews_ || (labels_ == kCameraLabels &&
                                         std::any_of(cameras_.begin(), cameras_.end(), is_offset));
  if (!needs_motion && !wants_motion_) return {};
  std::vector<Matrix34d> T_map_sensor;
  for (const Matrix34d& pose : *poses) T_map_sensor.push_back(lidar_pose(*T_camera_lidar, pose));
  Outcome<ScanMotion> motion = ScanMotion::load(
      dir_, {.T_map_sensor = T_map_sensor, .T_camera_lidar = *T_camera_lidar}, needed);
  if (!motion.ok()) return motion.failure();
  motion_ = std::move(*motion);
  return {};
}

Outcome<void> Dataset::check_times() {
  if (!has_times_) return {};
  const Outcome<void> present = require_folder(
      "folder of times", in_folder(dir_, "times"),
      "get the times of the points, or give " + kSourceSettings["--deskew"] + " off");
  if (!present.ok()) return present.failure();
  for (const Entry& scan : scans_) {
    const ScanFilePath path(dir_, "times", scan.number, ".bin");
    const Outcome<std::uint64_t> size = file_size_bytes(path);
    if (!size.ok()) return size.failure();
    if (*size == scan.points * sizeof(float)) continue;
    return Failure{std::string(path.view()) + " has " + std::to_string(*size) +
                   " bytes, but its scan has " + std::to_string(scan.points) +
                   " points of 4 each; get the times that belong to this scan, or give " +
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
  return check_label_files(folder, "name a folder of labels that exists");
}

Outcome<void> Dataset::check_label_files(const std::string& folder, const Message& remedy) const {
  if (folder.empty()) return Failure{"the label folder has no name; " + remedy};
  const Outcome<void> present = require_folder("label folder", in_folder(dir_, folder), remedy);
  if (!present.ok()) return present.failure();
  for (const Entry& scan : scans_) {
    const ScanFilePath path(dir_, folder, scan.number, ".label");
    const Outcome<std::uint64_t> size = file_size_bytes(path);
    if (!size.ok()) return size.failure();
    if (*size == scan.points * kBytesPerLabel) continue;
    const std::string have = *size % kBytesPerLabel == 0
                                 ? std::to_string(*size / kBytesPerLabel) + " labels"
                                 : std::to_string(*size) + " bytes (not a whole number of labels)";
    return Failure{std::string(path.view()) + " has " + have + ", but its scan has " +
                   std::to_string(scan.points) +
                   " points; get the labels that belong to this scan"};
  }
  return {};
}

}  // namespace tessera
