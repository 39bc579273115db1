// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/cloud_folder.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

#include "base/system_failure.hpp"
#include "scans/pcd_reader.hpp"
#include "scans/ply_reader.hpp"
#include "scans/posed_files.hpp"
#include "settings/source_options.hpp"

namespace tessera {
namespace {

bool is_digit(char letter) noexcept { return letter >= '0' && letter <= '9'; }

/// Splits off the digits that text begins with, without leading zeros.
std::string_view take_digits(std::string_view& text) noexcept {
  const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
  std::string_view digits = text.substr(0, static_cast<std::size_t>(end - text.begin()));
  text.remove_prefix(digits.size());
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  return digits;
}

std::string_view extension_of(CloudFormat format) {
  return format == CloudFormat::kPcd ? ".pcd" : ".ply";
}

Outcome<CloudSummary> inspect_cloud(const CloudOptions& options, const CloudHead& head) {
  const CloudBytes bytes{head.path, head.bytes, options.with_labels};
  return options.format == CloudFormat::kPcd ? inspect_pcd(bytes, head.file_bytes)
                                             : inspect_ply(bytes, head.file_bytes);
}

Outcome<void> read_cloud(CloudFormat format, const CloudBytes& file, Cloud& cloud) {
  return format == CloudFormat::kPcd ? read_pcd(file, cloud) : read_ply(file, cloud);
}

}  // namespace

bool is_before_by_number(std::string_view a, std::string_view b) noexcept {
  const std::string_view whole_a = a;
  const std::string_view whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view number_a = take_digits(a);
      const std::string_view number_b = take_digits(b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
      continue;
    }
    if (a.front() != b.front()) return a.front() < b.front();
    a.remove_prefix(1);
    b.remove_prefix(1);
  }
  if (a.empty() != b.empty()) return a.empty();
  return whole_a < whole_b;  // Equal but for leading zeros: any fixed order will do.
}

Outcome<std::vector<std::string>> list_clouds(const std::string& folder, CloudFormat format) {
  return list_by_number(folder, extension_of(format));
}

Outcome<std::vector<std::string>> list_by_number(const std::string& folder,
                                                 std::string_view extension) {
  std::error_code error;
  std::filesystem::directory_iterator files(folder, error);
  std::vector<std::string> names;
  while (!error && files != std::filesystem::directory_iterator()) {
    std::string name = files->path().filename().string();
    if (name.ends_with(extension)) names.push_back(std::move(name));
    files.increment(error);
  }
  if (error) return system_failure("list", folder, error.value(), FailureKind::kUsage);
  if (names.empty()) {
    return Failure{"there are no " + std::string(extension) + " files in " + one_line(folder) +
                   "; name the folder that has them"};
  }
  std::sort(names.begin(), names.end(), is_before_by_number);
  for (std::string& name : names) name = (std::filesystem::path(folder) / name).string();
  return names;
}

CloudFolder::CloudFolder(CloudOptions options, DatasetClasses classes)
    : options_(std::move(options)), classes_(std::move(classes)) {}

Outcome<CloudFolder> CloudFolder::open(const std::string& folder, const CloudOptions& options) {
  TESSERA_TRY_ASSIGN(const std::vector<std::string> paths, list_clouds(folder, options.format));
  TESSERA_TRY_ASSIGN(DatasetClasses classes, DatasetClasses::load(folder));
  TESSERA_TRY_ASSIGN(const PoseRows poses, read_pose_rows(options.poses));
  CloudFolder clouds(options, std::move(classes));
  TESSERA_TRY_ASSIGN(const std::vector<PosedFile> files,
                     choose_files({.folder = folder,
                                   .kind = extension_of(options.format),
                                   .poses = options.poses,
                                   .first = options.first,
                                   .last = options.last},
                                  paths, poses));
  for (const PosedFile& file : files) clouds.scans_.push_back({.file = file, .summary = {}});
  clouds.num_files_ = paths.size();
  clouds.num_poses_ = poses.T_map_sensor.size();
  if (options.with_motion) clouds.motion_ = ScanMotion::of(poses);
  TESSERA_TRY(clouds.inspect());
  return clouds;
}

Outcome<void> CloudFolder::inspect() {
  for (Entry& scan : scans_) {
    TESSERA_TRY_ASSIGN(const CloudHead head, read_cloud_head(scan.file.path));
    TESSERA_TRY_ASSIGN(const CloudSummary summary, inspect_cloud(options_, head));
    scan.summary = summary;
    max_points_ = std::max(max_points_, summary.points);
    if (summary.has_labels) ++num_labelled_;
    if (summary.has_viewpoint) ++num_viewpoints_;
  }
  return {};
}

RegistrarConfig CloudFolder::registration() const {
  RegistrarConfig config;
  config.num_classes = classes_.table().num_classes();
  config.limits = {.points = max_points_,
                   .cameras = 0,
                   .image_pixels = 0,
                   .floats_per_point = kFloatsPerPoint,
                   .weights = false,
                   .no_returns = options_.with_no_returns};
  return config;
}

Outcome<void> CloudFolder::read(std::size_t i, Scan& into) const {
  const Entry& entry = scans_[i];
  const Outcome<std::string> bytes = read_cloud_bytes(entry.file.path);
  if (!bytes.ok()) return Failure{bytes.failure().message, FailureKind::kFailure};
  Cloud cloud;
  TESSERA_TRY(read_cloud(options_.format,
                         {entry.file.path, *bytes, options_.with_labels, options_.with_no_returns},
                         cloud));
  if (cloud.num_points() > max_points_) {
    Failure changed =
        cloud_failure(entry.file.path, "it has more points than when the folder was opened",
                      "do not change its files during a run");
    changed.kind = FailureKind::kFailure;
    return changed;
  }
  into.clear();
  into.reserve(cloud.num_points());
  into.number = entry.file.number;
  into.count = static_cast<std::uint32_t>(cloud.num_points());
  if (motion_) into.stamp_us = motion_->stamp_us(entry.file.number);
  into.T_map_body = into.T_map_sensor = entry.file.T_map_sensor;
  std::copy(cloud.points_xyzi.begin(), cloud.points_xyzi.end(), into.points().begin());
  into.has_components = true;
  into.has_no_return = !cloud.no_return.empty();
  std::copy(cloud.no_return.begin(), cloud.no_return.end(), into.no_return().begin());
  into.unknown = label(cloud, into.components().first(into.count));
  return {};
}

UnknownRawIds CloudFolder::label(const Cloud& cloud, std::span<std::uint8_t> components) const {
  UnknownRawIds unknown;
  std::fill(components.begin(), components.end(), classes_.unlabelled());
  if (cloud.raw_ids.empty()) return unknown;
  for (std::size_t point = 0; point < components.size(); ++point) {
    // As in KITTI's files: the upper 16 bits are the instance.
    const auto raw_id = static_cast<std::uint16_t>(cloud.raw_ids[point] & 0xFFFF);
    if (!classes_.is_known(raw_id)) unknown.add(raw_id);
    components[point] = classes_.component(raw_id);
  }
  return unknown;
}

}  // namespace tessera
