// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/registrar.hpp"

#include <algorithm>
#include <array>

#include "pictures/png_image.hpp"
#include "tessera/base/arena.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/registration/camera_pose.hpp"

namespace tessera {

namespace {

LabelProjectionCapacity capacity_of(const RegistrarConfig& config) {
  LabelProjectionCapacity capacity{
      .points = static_cast<std::uint32_t>(
          std::clamp<std::size_t>(config.limits.points, 1, LabelProjectionCapacity::kMostPoints)),
      .width_px = 1,
      .height_px = 1};
  for (const CameraDescription& camera : config.cameras) {
    capacity.width_px = std::max(capacity.width_px, camera.model.intrinsics().width_px);
    capacity.height_px = std::max(capacity.height_px, camera.model.intrinsics().height_px);
  }
  return capacity;
}

/// Whether a camera labels clouds.
bool projects(const RegistrarConfig& config) {
  return config.cameras.size() > (config.depth_camera >= 0 ? 1U : 0U);
}

template <class Image>
bool has_size_of(const CameraIntrinsics& camera, const Image& image) noexcept {
  return image.width_px == camera.width_px && image.height_px == camera.height_px;
}

}  // namespace

Outcome<std::unique_ptr<Registrar>> Registrar::make(const RegistrarConfig& config) {
  std::unique_ptr<Registrar> registrar(new Registrar(config));
  Outcome<void> done = registrar->read_masks();
  if (done.ok()) done = registrar->set_up();
  if (!done.ok()) return done.failure();
  return registrar;
}

Outcome<void> Registrar::read_masks() {
  for (const CameraDescription& camera : config_.cameras) {
    masks_.emplace_back();
    if (camera.mask.empty()) continue;
    const CameraIntrinsics& image = camera.model.intrinsics();
    masks_.back().resize(static_cast<std::size_t>(image.width_px) *
                         static_cast<std::size_t>(image.height_px));
    TESSERA_TRY(read_grey_png(camera.mask, image.width_px, image.height_px, masks_.back()));
  }
  return {};
}

std::size_t Registrar::required_bytes() const {
  std::size_t bytes = PoseTrack::required_bytes(Scan::kMostPoses) + kArenaAlignment;
  if (projects(config_))
    bytes += LabelProjector::required_bytes(capacity_of(config_), config_.projection);
  if (config_.depth_camera < 0) return bytes;
  const CameraIntrinsics& image =
      config_.cameras[static_cast<std::size_t>(config_.depth_camera)].model.intrinsics();
  const int step_px = config_.depth.step_px;
  const std::size_t points = DepthCamera::most_points(image.width_px, image.height_px, step_px);
  return bytes + DepthCamera::required_bytes(image.width_px, image.height_px, step_px) +
         arena_bytes<float>(3 * points) + arena_bytes<std::uint8_t>(points);
}

Outcome<void> Registrar::set_up() {
  TESSERA_TRY_ASSIGN(ArenaMemory memory, ArenaMemory::allocate(required_bytes()));
  memory_ = std::move(memory);
  Arena arena(memory_.span());
  const Result<PoseTrack> track = PoseTrack::make(Scan::kMostPoses, arena);
  Status status = track.status();
  if (track.ok()) track_ = *track;
  if (status == Status::kOk && projects(config_)) {
    const Result<LabelProjector> projector =
        LabelProjector::make(arena, config_.projection, capacity_of(config_));
    status = projector.status();
    if (projector.ok()) projector_ = *projector;
  }
  if (status == Status::kOk && config_.depth_camera >= 0) {
    const auto camera = static_cast<std::size_t>(config_.depth_camera);
    const Result<DepthCamera> depth =
        DepthCamera::make(arena, config_.cameras[camera].model, config_.depth);
    status = depth.status();
    if (depth.ok()) {
      depth_ = *depth;
      depth_points_ = arena.take<float>(3 * depth_.most_points());
      depth_components_ = arena.take<std::uint8_t>(depth_.most_points());
    }
  }
  if (status == Status::kOk) return {};
  return Failure{std::string("the sensors cannot be set up: ") + to_string(status)};
}

void RegistrarReport::add(const RegistrationRecord& record) noexcept {
  if (record.deskew) {
    const bool done = record.deskew->status == Status::kOk;
    ++(done ? deskewed : not_deskewed);
    moved += record.deskew->moved;
    points_unplaced += record.deskew->bad_time + record.deskew->without_pose;
  }
  if (record.depth && record.depth->status == Status::kOk) {
    const DepthReport& d = *record.depth;
    ++depth_images;
    depth_points += d.points;
    no_depth += d.no_depth;
    flying += d.flying;
    depth_refused += d.too_near + d.too_far + d.flying + d.no_ray;
  }
  if (!record.projection || record.projection->status != Status::kOk) return;
  ++projected;
  projected_points += record.projection->points;
  labelled += record.projection->labelled;
  for (const LabelCameraReport& camera : record.projection->cameras) {
    occluded += camera.occluded;
    images_without_pose += camera.status == Status::kOutOfRange ? 1U : 0U;
  }
}

bool Registrar::view(Scan& scan, ScanView& into) noexcept {
  last_ = {};
  track_.clear();
  for (const StampedPose& pose : scan.poses()) static_cast<void>(track_.add(pose));
  const PoseTrack& track = scan.track != nullptr ? *scan.track : track_;
  bool made = true;
  if (scan.kind == ScanKind::kDepthImage) {
    made = take_depths(scan, into);
  } else {
    if (scan.has_times) take_out_motion(scan, track);
    if (!scan.has_components && scan.num_images > 0) take_labels(scan, track);
    into = scan.view();
  }
  counted_.add(last_);
  counted_.refused += made ? 0U : 1U;
  report_.set(counted_);
  return made;
}

void Registrar::take_out_motion(Scan& scan, const PoseTrack& track) noexcept {
  const Sweep sweep{.points = scan.points_view(),
                    .times_s = scan.times_s().data(),
                    .stamp_us = scan.stamp_us,
                    .T_body_sensor = scan.T_body_sensor,
                    .body = config_.body,
                    .no_return = scan.has_no_return ? scan.no_return().data() : nullptr};
  last_.deskew = deskew(track, sweep, config_.deskew, scan.points());
}

/// Fails with kOutOfRange iff there is no pose at the image's or the scan's stamp, with
/// kInvalidArgument iff it is not an image of a camera.
Status Registrar::place(const ScanImage& image, const Scan& scan, const PoseTrack& track,
                        LabelCamera& into) noexcept {
  const auto number = static_cast<std::size_t>(image.camera);
  if (image.camera < 0 || number >= config_.cameras.size() ||
      !has_size_of(config_.cameras[number].model.intrinsics(), image))
    return Status::kInvalidArgument;
  const CameraDescription& camera = config_.cameras[number];
  const CameraMount mount{
      .T_camera_body = product(camera.T_camera_lidar, inverse(config_.T_body_lidar)),
      .T_body_lidar = scan.T_body_sensor};
  const Result<Matrix34d> T_camera_lidar =
      camera_from_lidar(track, mount, image.stamp_us, scan.stamp_us, kMaxPoseGap_us);
  if (!T_camera_lidar.ok()) return T_camera_lidar.status();
  into.model = camera.model;
  into.T_camera_lidar = *T_camera_lidar;
  into.labels = image.components().data();
  into.row_stride_bytes = static_cast<std::size_t>(image.width_px);
  into.mask = masks_[number].empty() ? nullptr : masks_[number].data();
  into.mask_stride_bytes = into.row_stride_bytes;
  return Status::kOk;
}

void Registrar::take_labels(Scan& scan, const PoseTrack& track) noexcept {
  std::array<LabelCamera, kMostCameras> cameras;
  std::array<Status, kMostCameras> placed{};
  const std::span<const ScanImage> images = scan.images();
  for (std::size_t i = 0; i < images.size(); ++i) {
    placed[i] = place(images[i], scan, track, cameras[i]);  // Without labels it is left out.
    counted_.images_refused += placed[i] == Status::kInvalidArgument ? 1U : 0U;
  }
  LabelReport& report = last_.projection.emplace(
      projector_.project(scan.points_view(), std::span(cameras).first(images.size()),
                         config_.num_classes, scan.components()));
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (placed[i] != Status::kOk) report.cameras[i].status = placed[i];
  }
  scan.has_components = report.status == Status::kOk;
}

bool Registrar::take_depths(Scan& scan, ScanView& into) noexcept {
  if (config_.depth_camera < 0) return false;
  const CameraIntrinsics& expected =
      config_.cameras[static_cast<std::size_t>(config_.depth_camera)].model.intrinsics();
  if (!has_size_of(expected, scan)) {
    ++counted_.images_refused;
    return false;
  }
  const auto width = static_cast<std::size_t>(expected.width_px);
  DepthImage image{.metres = scan.depth_m().data(), .stride_pixels = width};
  if (scan.num_images > 0) {
    const ScanImage& labels = scan.images()[0];
    // Labels of another size would be read beyond their end, so they are ignored.
    if (has_size_of(expected, labels)) {
      image.labels = labels.components().data();
      image.label_stride_bytes = width;
    } else {
      ++counted_.images_refused;
    }
  }
  const DepthReport& report = last_.depth.emplace(
      depth_.to_points(image, config_.num_classes, depth_points_, depth_components_));
  if (report.status != Status::kOk) return false;
  into = ScanView{.T_map_sensor = scan.T_map_sensor,
                  .points = depth_points_.data(),
                  .stride_floats = 3,
                  .count = report.points,
                  .components = depth_components_.data(),
                  .T_body_sensor = scan.T_body_sensor};
  return true;
}

}  // namespace tessera
