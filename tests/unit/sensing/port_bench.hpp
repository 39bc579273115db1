// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A port on a network of the test's own, and sweeps to send it.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>
#include <random>
#include <vector>

#include "link/sensor_sender.hpp"
#include "scans/sensor_port.hpp"
#include "unit/lcm/own_network.hpp"

namespace tessera {

constexpr std::int64_t kForever_us = 1'000'000'000;

inline SensorPortConfig port_config() {
  SensorPortConfig config;
  config.link.url = kDefaultSensorUrl;
  config.link.assembler.max_message_bytes = 3U << 20U;
  config.matcher.sensors = {{0, MountedKind::kSemanticCloud}};
  config.matcher.slot = {.points = 120'000, .image_pixels = 16};
  config.matcher.pending_scans = 16;
  config.matcher.max_age_us = kForever_us;
  return config;
}

inline std::unique_ptr<SensorPort> open_port(const SensorPortConfig& config) {
  Outcome<std::unique_ptr<SensorPort>> port = SensorPort::open(config);
  INFO(port.failure().text());
  REQUIRE(port.ok());
  return std::move(*port);
}

inline std::unique_ptr<SensorSender> open_sender() {
  Outcome<std::unique_ptr<SensorSender>> sender = SensorSender::open(kDefaultSensorUrl, "lo");
  REQUIRE(sender.ok());
  return std::move(*sender);
}

/// A sweep whose every number follows from its seed.
struct SampleSweep {
  SampleSweep(std::size_t points, unsigned seed) {
    std::mt19937 random(seed);
    for (std::size_t i = 0; i < points; ++i) {
      for (int axis = 0; axis < 3; ++axis)
        xyz.push_back(static_cast<float>(random() % 80'000) * 1e-3F - 40.0F);
      components.push_back(static_cast<std::uint8_t>(random() % 21));
      times_us.push_back(static_cast<std::int32_t>(random() % 1'000) - 1'000);
    }
  }
  [[nodiscard]] std::vector<std::byte> message(std::int64_t stamp_us) const {
    return encode(CloudToSend{
        .stamp_us = stamp_us, .xyz = xyz, .components = components, .times_us = times_us});
  }
  [[nodiscard]] bool is_in(Scan& slot) const {
    if (slot.count != components.size() || !slot.has_components || !slot.has_times) return false;
    for (std::size_t i = 0; i < times_us.size(); ++i) {
      if (slot.times_s()[i] != static_cast<float>(1e-6 * times_us[i])) return false;
    }
    return std::equal(xyz.begin(), xyz.end(), slot.points().begin()) &&
           std::equal(components.begin(), components.end(), slot.components().begin());
  }
  std::vector<float> xyz;
  std::vector<std::uint8_t> components;
  std::vector<std::int32_t> times_us;
};

inline std::vector<std::byte> pose_message(std::int64_t stamp_us, std::int32_t sequence) {
  PoseMessage pose{.stamp_us = stamp_us, .sequence = sequence, .quality = PoseQuality::kGood};
  pose.T_map_body(0, 3) = 1.0;
  return encode(pose);
}

/// Steps until condition is true, for two seconds at most.
template <class Condition>
bool eventually_stepped(SensorPort& port, Condition condition) {
  return eventually([&] {
    port.step(0);
    return condition();
  });
}

}  // namespace tessera
