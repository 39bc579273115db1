// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/depth_folder.hpp"

#include <fmt/core.h>

#include <filesystem>
#include <limits>
#include <span>
#include <system_error>

#include "pictures/png_image.hpp"
#include "scans/cloud.hpp"
#include "scans/cloud_folder.hpp"
#include "scans/posed_files.hpp"
#include "settings/source_options.hpp"

namespace tessera {

Outcome<DepthFolder> DepthFolder::open(const std::string& folder, const DepthOptions& options) {
  TESSERA_TRY_ASSIGN(DatasetClasses classes, DatasetClasses::load(folder));
  DepthFolder images(std::move(classes));
  TESSERA_TRY(images.choose(folder, options));
  TESSERA_TRY(images.find_labels(options.label_images));
  TESSERA_TRY(images.read_camera(options));
  return images;
}

Outcome<void> DepthFolder::choose(const std::string& folder, const DepthOptions& options) {
  TESSERA_TRY_ASSIGN(const std::vector<std::string> paths, list_by_number(folder, ".png"));
  TESSERA_TRY_ASSIGN(const PoseRows poses, read_pose_rows(options.poses));
  TESSERA_TRY_ASSIGN(const std::vector<PosedFile> files, choose_files({.folder = folder,
                                                                       .kind = ".png",
                                                                       .poses = options.poses,
                                                                       .first = options.first,
                                                                       .last = options.last},
                                                                      paths, poses));
  for (const PosedFile& file : files) scans_.push_back({file, {}});
  num_files_ = paths.size();
  num_poses_ = poses.T_map_sensor.size();
  if (options.with_motion) motion_ = ScanMotion::of(poses);
  return {};
}

Outcome<void> DepthFolder::find_labels(const std::string& folder) {
  has_labels_ = !folder.empty();
  if (!has_labels_) return {};
  for (Entry& scan : scans_) {
    const std::filesystem::path name = std::filesystem::path(scan.file.path).filename();
    scan.label_path = (std::filesystem::path(folder) / name).string();
    std::error_code error;
    if (std::filesystem::exists(scan.label_path, error)) continue;
    return Failure{one_line(scan.label_path) +
                   " is missing; give a label image of the same name for each depth image, or "
                   "leave " +
                   kSourceSettings["--label-images"] + " out"};
  }
  return {};
}

Outcome<void> DepthFolder::read_camera(const DepthOptions& options) {
  TESSERA_TRY_ASSIGN(const DepthCameraDescription description,
                     read_depth_camera(options.intrinsics));
  camera_ = description;
  if (num_pixels() <= kMostCloudPoints) return {};
  return Failure{fmt::format("{}: its images have {} pixels, the limit is {}; scale them down",
                             one_line(options.intrinsics), num_pixels(), kMostCloudPoints)};
}

std::size_t DepthFolder::num_pixels() const noexcept {
  return static_cast<std::size_t>(camera_.model.width_px()) *
         static_cast<std::size_t>(camera_.model.height_px());
}

std::size_t DepthFolder::max_points() const noexcept {
  return DepthCamera::most_points(camera_.model.width_px(), camera_.model.height_px(),
                                  camera_.depth.step_px);
}

/// The depths take the memory of the points' coordinates.
ScanLimits DepthFolder::limits() const noexcept {
  constexpr std::size_t kFloats = 3;
  return {.points = num_pixels() / kFloats + 1,
          .cameras = has_labels_ ? std::size_t{1} : std::size_t{0},
          .image_pixels = num_pixels(),
          .floats_per_point = kFloats,
          .weights = false};
}

RegistrarConfig DepthFolder::registration() const {
  RegistrarConfig config;
  config.cameras.emplace_back().model = camera_.model;
  config.num_classes = classes_.table().num_classes();
  config.limits = limits();
  config.depth = camera_.depth;
  config.depth_camera = 0;
  return config;
}

/// Counts unknown ids among the sampled pixels.
Outcome<void> DepthFolder::read_labels(const Entry& entry, Scan& into) const {
  const CameraModel& model = camera_.model;
  TESSERA_TRY(read_grey_png(entry.label_path, model.width_px(), model.height_px(),
                            GreyBits::kEightOrSixteen, pixels_));
  ScanImage& image = into.image_memory[0];
  image.width_px = model.width_px();
  image.height_px = model.height_px();
  image.camera = 0;
  image.stamp_us = into.stamp_us;
  into.num_images = 1;
  for (std::size_t i = 0; i < pixels_.size(); ++i) image.memory[i] = classes_.component(pixels_[i]);
  const auto step = static_cast<std::size_t>(camera_.depth.step_px);
  const auto width = static_cast<std::size_t>(model.width_px());
  for (std::size_t row = 0; row < pixels_.size(); row += step * width) {
    for (std::size_t column = 0; column < width; column += step) {
      const std::uint16_t raw_id = pixels_[row + column];
      if (!classes_.is_known(raw_id)) into.unknown.add(raw_id);
    }
  }
  return {};
}

Outcome<void> DepthFolder::read(std::size_t i, Scan& into) const {
  const Entry& entry = scans_[i];
  into.clear();
  into.number = entry.file.number;
  if (motion_) into.stamp_us = motion_->stamp_us(entry.file.number);
  into.kind = ScanKind::kDepthImage;
  into.width_px = camera_.model.width_px();
  into.height_px = camera_.model.height_px();
  into.T_map_body = into.T_map_sensor = entry.file.T_map_sensor;
  pixels_.resize(num_pixels());
  TESSERA_TRY(
      read_grey_png(entry.file.path, into.width_px, into.height_px, GreyBits::kSixteen, pixels_));
  const std::span<float> depth_m = into.points();
  for (std::size_t pixel = 0; pixel < pixels_.size(); ++pixel)
    depth_m[pixel] = static_cast<float>(pixels_[pixel] * camera_.depth_scale_m);
  return has_labels_ ? read_labels(entry, into) : Outcome<void>();
}

}  // namespace tessera
