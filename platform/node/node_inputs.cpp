// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Opens the source of a node's scans: a dataset, or sensors, with their classes and cameras.
#include <fmt/core.h>

#include <algorithm>

#include "base/input_file.hpp"
#include "base/monotonic_clock.hpp"
#include "node/node.hpp"
#include "scans/transform_file.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

std::size_t pixels_of(const CameraDescription& camera) {
  const CameraIntrinsics& image = camera.model.intrinsics();
  return static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px);
}

Outcome<DatasetClasses> classes_of(const SensorsConfig& sensors) {
  if (sensors.classes.empty()) return DatasetClasses::semantic_kitti();
  constexpr std::size_t kMostBytes = 1U << 20U;
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(sensors.classes, kMostBytes));
  return DatasetClasses::parse(text, sensors.classes);
}

/// None of the sensors is in a box of the body.
Outcome<void> check_beside(const std::vector<MountedSensor>& sensors, const RobotBody& body) {
  for (const MountedSensor& sensor : sensors) {
    const bool is_camera = sensor.kind == MountedKind::kDepthCamera;
    TESSERA_TRY(check_body(body, sensor.T_body_sensor,
                           is_camera ? "the depth camera" : "the lidar of [sensors]"));
  }
  return {};
}

}  // namespace

Outcome<void> Node::open_inputs() {
  if (config_.sensors.enabled) return open_sensors();
  TESSERA_TRY(check_source(config_.map));
  TESSERA_TRY_ASSIGN(OpenedScans opened, open_scans(config_.map, {.no_returns = true}));
  recorded_ = std::move(opened);
  classes_ = recorded_.scans->classes();
  return {};
}

Outcome<void> Node::open_sensors() {
  const SensorsConfig& sensors = config_.sensors;
  TESSERA_TRY_ASSIGN(DatasetClasses classes, classes_of(sensors));
  classes_ = std::move(classes);
  if (!sensors.T_body_lidar.empty()) {
    TESSERA_TRY_ASSIGN(const Matrix34d T, read_transform(sensors.T_body_lidar));
    T_body_lidar_ = T;
  }
  if (sensors.cameras.empty()) return {};
  TESSERA_TRY_ASSIGN(std::vector<CameraDescription> cameras, read_cameras(sensors.cameras));
  cameras_ = std::move(cameras);
  if (!sensors.depth_camera || *sensors.depth_camera < cameras_.size()) return {};
  return Failure{fmt::format("{} has {} cameras; [sensors] depth_camera counts from 0",
                             sensors.cameras, cameras_.size())};
}

ScanContent Node::scan_content() const {
  std::size_t points = recorded_.scans ? recorded_.scans->max_points() : config_.sensors.points;
  if (config_.sensors.enabled && config_.sensors.depth_camera) {
    const CameraIntrinsics& image = cameras_[*config_.sensors.depth_camera].model.intrinsics();
    points = std::max(
        points, DepthCamera::most_points(image.width_px, image.height_px, DepthConfig{}.step_px));
  }
  return {.max_points = points, .classes = classes()};
}

SensorPortConfig Node::sensor_config() const {
  const SensorsConfig& sensors = config_.sensors;
  SensorPortConfig port;
  port.link.url = sensors.url;
  port.link.interface = sensors.interface;
  port.clock = sensors.clock;
  port.robot = config_.robot;
  port.takes_corrections = true;
  MatcherConfig& matcher = port.matcher;
  matcher.max_wait_us = microseconds(1e-3 * sensors.max_wait_ms);
  matcher.max_pose_gap_us = microseconds(1e-3 * sensors.max_pose_gap_ms);
  // As many as arrive while one waits, and the one that is being received.
  const double waiting = sensors.max_wait_ms / static_cast<double>(config_.period_ms);
  matcher.pending_scans =
      std::max(matcher.pending_scans, static_cast<std::size_t>(std::min(waiting, 14.0)) + 2);
  matcher.max_image_offset_us = microseconds(1e-3 * sensors.max_image_offset_ms);
  matcher.missing_images = sensors.missing_images;
  matcher.slot.points = scan_content().max_points;
  matcher.slot.no_returns = true;
  matcher.slot.weighted_labels = kMostLabels;
  matcher.slot.image_pixels = 1;
  for (const CameraDescription& camera : cameras_)
    matcher.slot.image_pixels = std::max(matcher.slot.image_pixels, pixels_of(camera));
  if (sensors.clouds != CloudKind::kNone) {
    const bool raw = sensors.clouds == CloudKind::kRaw;
    matcher.sensors.push_back({.number = sensors.lidar,
                               .kind = raw ? MountedKind::kRawCloud : MountedKind::kSemanticCloud,
                               .T_body_sensor = T_body_lidar_});
    for (std::size_t i = 0; raw && i < cameras_.size(); ++i) {
      if (sensors.depth_camera != i) matcher.cameras.push_back(static_cast<std::int32_t>(i));
    }
  }
  if (sensors.depth_camera) {
    const std::size_t camera = *sensors.depth_camera;
    // A depth image uses the memory of the points' coordinates.
    matcher.slot.points = std::max(matcher.slot.points, matcher.slot.image_pixels / 3 + 1);
    matcher.sensors.push_back(
        {.number = static_cast<std::int32_t>(camera),
         .kind = MountedKind::kDepthCamera,
         .T_body_sensor = product(T_body_lidar_, inverse(cameras_[camera].T_camera_lidar))});
  }
  return port;
}

Outcome<void> Node::make_sensing() {
  if (!config_.sensors.enabled) {
    // The source wakes the mapping thread, which takes scans from the source.
    replay_ = std::make_unique<ReplaySource>(
        *recorded_.scans,
        ReplayConfig{.rate_hz = config_.rate_hz,
                     .order = config_.loop ? ScanOrder::kLoop : ScanOrder::kOnce,
                     .start_delay_s = config_.start_delay_s},
        mapping_wake_);
    return {};
  }
  const SensorPortConfig port = sensor_config();
  const bool by_bus = config_.sensors.poses == PoseWay::kCan;
  TESSERA_TRY_ASSIGN(std::unique_ptr<SensingThread> sensing,
                     SensingThread::open(port, config_.vehicle.guard, vehicle_port_.get(), by_bus));
  sensing_ = std::move(sensing);
  return {};
}

/// Reads the cameras' masks.
Outcome<void> Node::make_registrar() {
  RegistrarConfig registrar;
  if (config_.sensors.enabled) {
    registrar.cameras = cameras_;
    registrar.num_classes = classes().num_classes();
    registrar.limits = sensor_config().matcher.slot;
    registrar.T_body_lidar = T_body_lidar_;
    if (config_.sensors.depth_camera)
      registrar.depth_camera = static_cast<int>(*config_.sensors.depth_camera);
  } else {
    registrar = recorded_.scans->registration();
  }
  const RobotBody& body = setup_.map.inference.body;
  TESSERA_TRY(config_.sensors.enabled ? check_beside(sensor_config().matcher.sensors, body)
                                      : check_body(body, Matrix34d::Identity(), "the sensor"));
  registrar.body = body;
  TESSERA_TRY_ASSIGN(std::unique_ptr<Registrar> made, Registrar::make(registrar));
  registrar_ = std::move(made);
  return {};
}

}  // namespace tessera
