// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/camera_labels.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include "pictures/png_image.hpp"
#include "scans/scan_listing.hpp"
#include "tessera/registration/camera_pose.hpp"

namespace tessera {
namespace {

std::size_t pixels_of(const CameraDescription& camera) {
  return static_cast<std::size_t>(camera.model.width_px()) *
         static_cast<std::size_t>(camera.model.height_px());
}

}  // namespace

Outcome<std::unique_ptr<CameraLabels>> CameraLabels::open(const std::string& dir) {
  const std::string path = in_folder(dir, "cameras.toml");
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return Failure{path +
                   " does not exist; --labels cameras needs it, with a [[camera]] for each "
                   "camera; add it, or give --labels a folder of labels or none"};
  Outcome<std::vector<CameraDescription>> cameras = read_cameras(path);
  if (!cameras.ok()) return cameras.failure();
  std::unique_ptr<CameraLabels> labels(new CameraLabels);
  labels->dir_ = dir;
  labels->cameras_ = std::move(*cameras);
  for (const CameraDescription& camera : labels->cameras_) {
    if (camera.folder.empty())
      return Failure{path + ": the camera '" + camera.name +
                     "' has no folder; write where its images are, as in folder = \"cameras/0\""};
    labels->images_.emplace_back(pixels_of(camera));
    const Outcome<void> mask = labels->read_mask(camera);
    if (!mask.ok()) return mask.failure();
  }
  return labels;
}

Outcome<void> CameraLabels::read_mask(const CameraDescription& camera) {
  std::vector<std::uint8_t>& mask = masks_.emplace_back();
  if (camera.mask.empty()) return {};
  mask.resize(pixels_of(camera));
  return read_grey_png(in_folder(dir_, camera.mask), camera.model.width_px(),
                       camera.model.height_px(), mask);
}

bool CameraLabels::needs_motion() const {
  return std::any_of(cameras_.begin(), cameras_.end(),
                     [](const CameraDescription& camera) { return camera.offset_us != 0; });
}

Outcome<void> CameraLabels::check_images(std::span<const int> scan_numbers) const {
  for (const CameraDescription& camera : cameras_) {
    for (const int number : scan_numbers) {
      const Outcome<std::uint64_t> size =
          file_size_bytes(ScanFilePath(dir_, camera.folder, number, ".png"));
      if (!size.ok())
        return Failure{size.failure().message + " (an image of the camera '" + camera.name +
                       "' is needed for each scan)"};
    }
  }
  return {};
}

Outcome<void> CameraLabels::reserve(std::size_t max_points) {
  LabelProjectionCapacity capacity{.points = 1, .width_px = 1, .height_px = 1};
  capacity.points = static_cast<std::uint32_t>(
      std::clamp<std::size_t>(max_points, 1, LabelProjectionCapacity::kMostPoints));
  for (const CameraDescription& camera : cameras_) {
    capacity.width_px = std::max(capacity.width_px, camera.model.width_px());
    capacity.height_px = std::max(capacity.height_px, camera.model.height_px());
  }
  memory_ = ArenaMemory(LabelProjector::required_bytes(capacity, {}));
  Arena arena(memory_.span());
  const Result<LabelProjector> projector = LabelProjector::make(arena, {}, capacity);
  if (!projector.ok()) return Failure{"no memory for the cameras' labels", FailureKind::kFailure};
  projector_ = *projector;
  return {};
}

Outcome<LabelReport> CameraLabels::read(const ScanToLabel& scan,
                                        std::span<std::uint8_t> components) {
  std::array<LabelCamera, kMostCameras> views;
  std::array<bool, kMostCameras> placed{};
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const CameraDescription& camera = cameras_[i];
    const ScanFilePath path(dir_, camera.folder, scan.number, ".png");
    const Outcome<void> decoded =
        read_grey_png(path.view(), camera.model.width_px(), camera.model.height_px(), images_[i]);
    if (!decoded.ok()) return decoded.failure();
    LabelCamera& view = views[i];
    view.model = camera.model;
    view.labels = images_[i].data();
    view.row_stride_bytes = static_cast<std::size_t>(camera.model.width_px());
    view.mask = masks_[i].empty() ? nullptr : masks_[i].data();
    view.mask_stride_bytes = view.row_stride_bytes;
    view.T_camera_lidar = camera.T_camera_lidar;
    placed[i] = camera.offset_us == 0;
    if (placed[i] || scan.motion == nullptr) continue;
    const std::int64_t scan_us = scan.motion->stamp_us(scan.number);
    const Result<Matrix34d> T_camera_lidar =
        camera_from_lidar(scan.motion->track(), {camera.T_camera_lidar, Matrix34d::Identity()},
                          scan_us + camera.offset_us, scan_us, ScanMotion::kMaxGap_us);
    placed[i] = T_camera_lidar.ok();
    if (placed[i]) view.T_camera_lidar = *T_camera_lidar;
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (!placed[i]) views[i].labels = nullptr;  // The projector leaves it out.
  }
  LabelReport report = projector_.project(scan.points, std::span(views).first(cameras_.size()),
                                          scan.num_classes, components);
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (!placed[i]) report.cameras[i].status = Status::kOutOfRange;
  }
  return report;
}

}  // namespace tessera
