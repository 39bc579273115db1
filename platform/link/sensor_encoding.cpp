// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <tessera_cloud.hpp>
#include <tessera_correction.hpp>
#include <tessera_depth_image.hpp>
#include <tessera_label_image.hpp>
#include <tessera_pose.hpp>
#include <tessera_semantic_cloud.hpp>

#include "link/sensor_sender.hpp"

namespace tessera {
namespace {

template <class Message>
std::vector<std::byte> encoded(const Message& message) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  const int written = message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  TESSERA_ASSERT(written == message.getEncodedSize());
  static_cast<void>(written);
  return bytes;
}

template <class To, class From>
std::int32_t copy(std::span<const From> from, std::vector<To>& to) {
  to.assign(from.begin(), from.end());
  return static_cast<std::int32_t>(from.size());
}

/// The quaternion of a rotation, by its largest part, which avoids cancellation.
void write_rotation(const Matrix34d& T, double (&q)[4]) {
  const double trace = T(0, 0) + T(1, 1) + T(2, 2);
  int largest = 0;
  double most = trace;
  for (int i = 0; i < 3; ++i) {
    if (T(i, i) > most) {
      most = T(i, i);
      largest = i + 1;
    }
  }
  if (largest == 0) {
    q[0] = 1.0 + trace;
    q[1] = T(2, 1) - T(1, 2);
    q[2] = T(0, 2) - T(2, 0);
    q[3] = T(1, 0) - T(0, 1);
  } else {
    const int i = largest - 1;
    const int j = (i + 1) % 3;
    const int k = (i + 2) % 3;
    q[0] = T(k, j) - T(j, k);
    q[1 + i] = 1.0 + T(i, i) - T(j, j) - T(k, k);
    q[1 + j] = T(j, i) + T(i, j);
    q[1 + k] = T(k, i) + T(i, k);
  }
  double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (q[0] < 0.0) length = -length;
  for (double& part : q) part /= length;
}

}  // namespace

std::vector<std::byte> encode(const CloudToSend& cloud) {
  const auto points = static_cast<std::int32_t>(cloud.xyz.size() / 3);
  const auto fill = [&](auto& message) {
    message.stamp_us = cloud.stamp_us;
    message.sensor = cloud.sensor;
    message.count = points;
    message.coordinates = copy(cloud.xyz, message.xyz);
    message.times = copy(cloud.times_us, message.time_us);
    message.no_returns = copy(cloud.no_return, message.no_return);
  };
  if (cloud.components.empty()) {
    tessera_cloud message;
    fill(message);
    return encoded(message);
  }
  tessera_semantic_cloud message;
  fill(message);
  message.components = copy(cloud.components, message.component);
  message.label_weights = copy(cloud.label_weights, message.label_weight);
  message.weights = copy(cloud.weights, message.weight);
  return encoded(message);
}

std::vector<std::byte> encode(const ImageToSend& image) {
  tessera_label_image message;
  message.stamp_us = image.header.stamp_us;
  message.camera = image.header.camera;
  message.width = image.header.width_px;
  message.height = image.header.height_px;
  message.pixels = copy(image.components, message.component);
  return encoded(message);
}

std::vector<std::byte> encode(const DepthToSend& image) {
  tessera_depth_image message;
  message.stamp_us = image.header.stamp_us;
  message.camera = image.header.camera;
  message.width = image.header.width_px;
  message.height = image.header.height_px;
  message.metres = copy(image.depth_m, message.depth_m);
  message.millimetres = copy(image.depth_mm, message.depth_mm);
  return encoded(message);
}

std::vector<std::byte> encode(const PoseMessage& pose) {
  tessera_pose message{};
  message.stamp_us = pose.stamp_us;
  message.sequence = pose.sequence;
  message.quality = static_cast<std::int32_t>(pose.quality);
  for (int i = 0; i < 3; ++i) {
    message.position_m[i] = pose.T_map_body(i, 3);
    message.position_sigma_m[i] = pose.position_sigma_m[i];
  }
  write_rotation(pose.T_map_body, message.rotation);
  message.rotation_sigma_rad = pose.rotation_sigma_rad;
  return encoded(message);
}

std::vector<std::byte> encode(const CorrectionToSend& correction) {
  tessera_correction message{};
  message.robot = static_cast<std::int32_t>(correction.robot);
  message.revision = static_cast<std::int32_t>(correction.revision);
  constexpr std::int32_t kSubmaps = tessera_correction::SUBMAPS;
  constexpr std::int32_t kBody = tessera_correction::BODY;
  message.kind = correction.of_submaps ? kSubmaps : kBody;
  message.count = copy(correction.keys, message.keys);
  for (const Matrix34d& pose : correction.poses) {
    double rotation[4] = {};
    write_rotation(pose, rotation);
    message.position_m.push_back({pose(0, 3), pose(1, 3), pose(2, 3)});
    message.rotation.emplace_back(std::begin(rotation), std::end(rotation));
  }
  message.position_sigma_m.assign(correction.poses.size(), -1.0);
  message.rotation_sigma_rad.assign(correction.poses.size(), -1.0);
  return encoded(message);
}

}  // namespace tessera
