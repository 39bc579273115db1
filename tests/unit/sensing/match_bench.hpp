// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A matcher with two lidars, two cameras and a depth camera, and its clock. Stamps and times in
// milliseconds, for reading.
#pragma once

#include <algorithm>
#include <cstdint>

#include "scans/sensor_matcher.hpp"

namespace tessera {

constexpr std::int64_t kMs = 1000;
constexpr std::int32_t kLidar = 0;     ///< Semantic clouds.
constexpr std::int32_t kRawLidar = 1;  ///< Needs images of cameras 0 and 1.
constexpr std::int32_t kDepth = 5;     ///< A depth camera.

inline MatcherConfig sample_config() {
  MatcherConfig config;
  config.sensors = {{kLidar, MountedKind::kSemanticCloud},
                    {kRawLidar, MountedKind::kRawCloud},
                    {kDepth, MountedKind::kDepthCamera}};
  config.sensors[0].T_body_sensor(2, 3) = 2.0;
  config.cameras = {0, 1};
  config.slot = {.points = 8, .image_pixels = 4};
  config.pending_scans = 3;
  config.handed_scans = 2;
  config.images = 3;
  config.poses = 16;
  return config;
}

/// A matcher and its clock.
struct MatchBench {
  explicit MatchBench(const MatcherConfig& config = sample_config()) : matcher(config) {}

  [[nodiscard]] SensorTime time() const { return {now_ms * kMs, (now_ms + clock_ahead_ms) * kMs}; }
  void scan(std::int32_t sensor, std::int64_t stamp_ms, std::int64_t last_ms = 0) {
    Scan& slot = matcher.next_scan();
    slot.kind = sensor == kDepth ? ScanKind::kDepthImage : ScanKind::kCloud;
    slot.sensor = sensor;
    slot.stamp_us = stamp_ms * kMs;
    slot.has_components = sensor == kLidar;
    slot.count = 1;
    slot.first_us = 0;
    slot.last_us = static_cast<std::int32_t>(last_ms * kMs);
    matcher.add_scan(time());
  }
  void image(std::int32_t camera, std::int64_t stamp_ms) {
    ScanImage& next = matcher.next_image();
    next.camera = camera;
    next.stamp_us = stamp_ms * kMs;
    next.width_px = next.height_px = 2;
    // Tells images from each other.
    std::fill(next.memory.begin(), next.memory.end(), static_cast<std::uint8_t>(stamp_ms + camera));
    matcher.add_image(time());
  }
  void pose(std::int64_t stamp_ms) {
    StampedPose one{.stamp_us = stamp_ms * kMs};
    one.T_map_body(0, 3) = static_cast<double>(stamp_ms);
    matcher.add_pose(one, time());
  }
  /// Poses every 10 ms.
  void poses(std::int64_t first_ms, std::int64_t last_ms) {
    for (std::int64_t at = first_ms; at <= last_ms; at += 10) pose(at);
  }
  /// The next that is given out, and back at once; -1: none.
  std::int64_t given() {
    const Scan* const slot = matcher.take_ready(time());
    if (slot == nullptr) return -1;
    const std::int64_t stamp_ms = slot->stamp_us / kMs;
    matcher.give_back(slot);
    return stamp_ms;
  }
  [[nodiscard]] const MatchReport& report() const { return matcher.report(); }

  SensorMatcher matcher;
  std::int64_t now_ms = 1000;
  std::int64_t clock_ahead_ms = 0;
};

}  // namespace tessera
