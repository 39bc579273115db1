// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/depth_folder.hpp"

#include <filesystem>
#include <limits>
#include <span>
#include <system_error>

#include "pictures/png_image.hpp"
#include "scans/cloud.hpp"
#include "scans/cloud_folder.hpp"
#include "scans/pose_file.hpp"

namespace tessera {

Outcome<DepthFolder> DepthFolder::open(const std::string& folder, const DepthOptions& options) {
  Outcome<DatasetClasses> classes = DatasetClasses::load(folder);
  if (!classes.ok()) return classes.failure();
  DepthFolder images(std::move(*classes));
  const Outcome<void> chosen = images.choose(folder, options);
  if (!chosen.ok()) return chosen.failure();
  const Outcome<void> labels = images.find_labels(options.label_images);
  if (!labels.ok()) return labels.failure();
  const Outcome<void> rig = images.make_rig(options);
  if (!rig.ok()) return rig.failure();
  return images;
}

Outcome<void> DepthFolder::choose(const std::string& folder, const DepthOptions& options) {
  const Outcome<std::vector<std::string>> paths = list_by_number(folder, ".png");
  if (!paths.ok()) return paths.failure();
  const Outcome<std::vector<Matrix34d>> T_map_camera = read_pose_rows(options.poses);
  if (!T_map_camera.ok()) return T_map_camera.failure();
  if (paths->size() != T_map_camera->size()) {
    return Failure{one_line(folder) + " has " + std::to_string(paths->size()) +
                   " .png files, but " + one_line(options.poses) + " has " +
                   std::to_string(T_map_camera->size()) +
                   " poses; give one pose for each image, in the order of their numbers"};
  }
  num_files_ = paths->size();
  const int first = options.first.value_or(0);
  const int last = options.last.value_or(std::numeric_limits<int>::max());
  if (first < 0 || last < 0)
    return Failure{"a scan number is negative; choose --first and --last from 0 on"};
  for (std::size_t i = static_cast<std::size_t>(first);
       i < paths->size() && i <= static_cast<std::size_t>(last); ++i)
    scans_.push_back({static_cast<int>(i), (*paths)[i], {}, (*T_map_camera)[i]});
  if (!scans_.empty()) return {};
  return Failure{"no scan is in the range, " + one_line(folder) + " has numbers from 0 to " +
                 std::to_string(paths->size() - 1) + "; choose --first and --last among them"};
}

Outcome<void> DepthFolder::find_labels(const std::string& folder) {
  if (folder.empty()) return {};
  for (Entry& scan : scans_) {
    const std::filesystem::path name = std::filesystem::path(scan.depth_path).filename();
    scan.label_path = (std::filesystem::path(folder) / name).string();
    std::error_code error;
    if (std::filesystem::exists(scan.label_path, error)) continue;
    return Failure{one_line(scan.label_path) +
                   " is missing; give a label image of the same name for each depth image, or "
                   "leave --label-images out"};
  }
  return {};
}

Outcome<void> DepthFolder::make_rig(const DepthOptions& options) {
  const Outcome<DepthCameraDescription> description = read_depth_camera(options.intrinsics);
  if (!description.ok()) return description.failure();
  rig_ = std::make_unique<Rig>();
  rig_->description = *description;
  const CameraModel& model = description->model;
  const int step_px = description->depth.step_px;
  const std::size_t most_points =
      DepthCamera::most_points(model.width_px(), model.height_px(), step_px);
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(model.width_px()) * static_cast<std::uint64_t>(model.height_px());
  if (pixels > kMostCloudPoints) {
    return Failure{one_line(options.intrinsics) + ": its images have " + std::to_string(pixels) +
                   " pixels, the limit is " + std::to_string(kMostCloudPoints) +
                   "; scale them down"};
  }
  const std::size_t bytes =
      DepthCamera::required_bytes(model.width_px(), model.height_px(), step_px);
  rig_->memory = ArenaMemory(bytes);
  Arena arena(rig_->memory.span());
  const Result<DepthCamera> camera = DepthCamera::make(arena, model, description->depth);
  if (!camera.ok()) {
    return Failure{one_line(options.intrinsics) +
                   " is not a valid camera: " + to_string(camera.status()) + "; check its numbers"};
  }
  rig_->camera = *camera;
  rig_->points.resize(3 * most_points);
  return {};
}

Outcome<UnknownRawIds> DepthFolder::read_labels(const Entry& entry) const {
  UnknownRawIds unknown;
  rig_->labels.clear();
  if (entry.label_path.empty()) return unknown;
  const CameraModel& model = rig_->description.model;
  const Outcome<void> read = read_grey_png(entry.label_path, model.width_px(), model.height_px(),
                                           GreyBits::kEightOrSixteen, rig_->pixels);
  if (!read.ok()) return read.failure();
  rig_->labels.resize(rig_->pixels.size());
  for (std::size_t i = 0; i < rig_->pixels.size(); ++i)
    rig_->labels[i] = classes_.component(rig_->pixels[i]);
  const auto step = static_cast<std::size_t>(rig_->description.depth.step_px);
  const auto width = static_cast<std::size_t>(model.width_px());
  for (std::size_t row = 0; row < rig_->pixels.size(); row += step * width) {
    for (std::size_t column = 0; column < width; column += step) {
      const std::uint16_t raw_id = rig_->pixels[row + column];
      if (!classes_.is_known(raw_id)) unknown.add(raw_id);
    }
  }
  return unknown;
}

Outcome<DatasetScan> DepthFolder::read(std::size_t i, ScanBuffer& buffer) const {
  const Entry& entry = scans_[i];
  const CameraModel& model = rig_->description.model;
  const auto width = static_cast<std::size_t>(model.width_px());
  rig_->pixels.resize(width * static_cast<std::size_t>(model.height_px()));
  const Outcome<void> read = read_grey_png(entry.depth_path, model.width_px(), model.height_px(),
                                           GreyBits::kSixteen, rig_->pixels);
  if (!read.ok()) return read.failure();
  rig_->depth_m.resize(rig_->pixels.size());
  for (std::size_t pixel = 0; pixel < rig_->pixels.size(); ++pixel) {
    const double depth_m = rig_->pixels[pixel] * rig_->description.depth_scale_m;
    rig_->depth_m[pixel] = static_cast<float>(depth_m);
  }
  const Outcome<UnknownRawIds> unknown = read_labels(entry);
  if (!unknown.ok()) return unknown.failure();
  DepthImage image;
  image.metres = rig_->depth_m.data();
  image.stride_pixels = width;
  image.labels = rig_->labels.empty() ? nullptr : rig_->labels.data();
  image.label_stride_bytes = width;
  const std::span<std::uint8_t> components = buffer.components(max_points());
  const DepthReport report =
      rig_->camera.to_points(image, classes_.table().num_classes(), rig_->points, components);
  const std::span<float> points = buffer.points_xyzi(report.points);
  for (std::size_t point = 0; point < report.points; ++point) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      points[4 * point + axis] = rig_->points[3 * point + axis];
    points[4 * point + 3] = 0.0F;
  }
  return DatasetScan{.number = entry.number,
                     .points_xyzi = points,
                     .components = components.first(report.points),
                     .unknown = *unknown,
                     .deskew = {},
                     .projection = {},
                     .depth = report,
                     .T_map_sensor = entry.T_map_camera};
}

}  // namespace tessera
