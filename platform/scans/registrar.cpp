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
      .points = static_cast<std::uint32_t>(config.slot.points), .width_px = 1, .height_px = 1};
  for (const CameraDescription& camera : config.cameras) {
    capacity.width_px = std::max(capacity.width_px, camera.model.intrinsics().width_px);
    capacity.height_px = std::max(capacity.height_px, camera.model.intrinsics().height_px);
  }
  return capacity;
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
    const Outcome<void> read =
        read_grey_png(camera.mask, image.width_px, image.height_px, masks_.back());
    if (!read.ok()) return read.failure();
  }
  return {};
}

std::size_t Registrar::required_bytes() const {
  std::size_t bytes = PoseTrack::required_bytes(ScanSlot::kMostPoses) + kArenaAlignment;
  if (!config_.cameras.empty())
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
  Outcome<ArenaMemory> memory = ArenaMemory::allocate(required_bytes());
  if (!memory.ok()) return memory.failure();
  memory_ = std::move(*memory);
  Arena arena(memory_.span());
  const Result<PoseTrack> track = PoseTrack::make(ScanSlot::kMostPoses, arena);
  Status status = track.status();
  if (track.ok()) track_ = *track;
  if (status == Status::kOk && !config_.cameras.empty()) {
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

bool Registrar::view(ScanSlot& slot, ScanView& into) noexcept {
  track_.clear();
  for (const StampedPose& pose : slot.poses()) static_cast<void>(track_.add(pose));
  bool made = true;
  if (slot.kind == SlotKind::kDepthImage) {
    made = take_depths(slot, into);
  } else {
    if (slot.has_times) take_out_motion(slot);
    if (!slot.has_components && slot.num_images > 0) take_labels(slot);
    into = slot.view();
  }
  counted_.refused += made ? 0U : 1U;
  report_.set(counted_);
  return made;
}

void Registrar::take_out_motion(ScanSlot& slot) noexcept {
  const Sweep sweep{.points = {slot.xyz().data(), 3, slot.count},
                    .times_s = slot.times_s().data(),
                    .stamp_us = slot.stamp_us,
                    .T_body_sensor = slot.T_body_sensor};
  const DeskewReport report = deskew(track_, sweep, config_.deskew, slot.xyz());
  if (report.status != Status::kOk) {
    ++counted_.not_deskewed;
    return;
  }
  ++counted_.deskewed;
  counted_.points_unplaced += report.bad_time + report.without_pose;
}

void Registrar::take_labels(ScanSlot& slot) noexcept {
  std::array<LabelCamera, kMostCameras> cameras;
  std::size_t count = 0;
  for (const SlotImage& image : slot.images()) {
    const auto number = static_cast<std::size_t>(image.camera);
    if (image.camera < 0 || number >= config_.cameras.size() ||
        !has_size_of(config_.cameras[number].model.intrinsics(), image)) {
      ++counted_.images_refused;
      continue;
    }
    const Matrix34d& T_camera_lidar = config_.cameras[number].T_camera_lidar;
    const CameraMount mount{.T_camera_body = product(T_camera_lidar, inverse(config_.T_body_lidar)),
                            .T_body_lidar = slot.T_body_sensor};
    const Result<Matrix34d> T =
        camera_from_lidar(track_, mount, image.stamp_us, slot.stamp_us, kMaxGap_us);
    if (!T.ok()) {
      ++counted_.images_without_pose;
      continue;
    }
    LabelCamera& camera = cameras[count++];
    camera.model = config_.cameras[number].model;
    camera.T_camera_lidar = *T;
    camera.labels = image.components().data();
    camera.row_stride_bytes = static_cast<std::size_t>(image.width_px);
    camera.mask = masks_[number].empty() ? nullptr : masks_[number].data();
    camera.mask_stride_bytes = camera.row_stride_bytes;
  }
  const LabelReport report =
      projector_.project({slot.xyz().data(), 3, slot.count}, std::span(cameras).first(count),
                         config_.num_classes, slot.components());
  if (report.status != Status::kOk) return;
  slot.has_components = true;
  ++counted_.projected;
  counted_.labelled += report.labelled;
  for (const LabelCameraReport& camera : report.cameras) counted_.occluded += camera.occluded;
}

bool Registrar::take_depths(ScanSlot& slot, ScanView& into) noexcept {
  if (config_.depth_camera < 0) return false;
  const CameraIntrinsics& expected =
      config_.cameras[static_cast<std::size_t>(config_.depth_camera)].model.intrinsics();
  if (!has_size_of(expected, slot)) {
    ++counted_.images_refused;
    return false;
  }
  const auto width = static_cast<std::size_t>(expected.width_px);
  DepthImage image{.metres = slot.depth_m().data(), .stride_pixels = width};
  if (slot.num_images > 0) {
    const SlotImage& labels = slot.images()[0];
    // Labels of another size would be read beyond their end, so they are ignored.
    if (has_size_of(expected, labels)) {
      image.labels = labels.components().data();
      image.label_stride_bytes = width;
    } else {
      ++counted_.images_refused;
    }
  }
  const DepthReport report =
      depth_.to_points(image, config_.num_classes, depth_points_, depth_components_);
  if (report.status != Status::kOk) return false;
  ++counted_.depth_images;
  counted_.flying += report.flying;
  into = ScanView{.T_map_sensor = slot.T_map_sensor,
                  .points = depth_points_.data(),
                  .stride_floats = 3,
                  .count = report.points,
                  .components = depth_components_.data()};
  return true;
}

}  // namespace tessera
