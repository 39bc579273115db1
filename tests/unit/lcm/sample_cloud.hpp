// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A message with a labelled cloud, and memory to decode it into.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <tessera_semantic_cloud.hpp>
#include <vector>

#include "link/sensor_messages.hpp"

namespace tessera {

/// Room for some points, and a mark behind it that nobody may touch.
struct Room {
  explicit Room(std::size_t points)
      : xyz(3 * points + 1, kMark),
        weights(points + 1, kMark),
        times_s(points + 1, kMark),
        components(3 * points + 1, 77),
        no_return(points + 1, 77),
        label_weights(3 * points + 1, 77) {}
  static constexpr float kMark = -12345.0F;
  std::vector<float> xyz, weights, times_s;
  std::vector<std::uint8_t> components, no_return, label_weights;

  CloudMemory memory() {
    const auto but_last = [](auto& list) { return std::span(list).first(list.size() - 1); };
    return {but_last(xyz),     but_last(components), but_last(weights),
            but_last(times_s), but_last(no_return),  but_last(label_weights)};
  }
  [[nodiscard]] bool is_untouched() const {
    const auto all = [](const std::vector<float>& list) {
      return std::all_of(list.begin(), list.end(), [](float f) { return f == kMark; });
    };
    return all(xyz) && all(weights) && all(times_s) &&
           std::all_of(components.begin(), components.end(), [](int c) { return c == 77; }) &&
           std::all_of(no_return.begin(), no_return.end(), [](int n) { return n == 77; }) &&
           std::all_of(label_weights.begin(), label_weights.end(), [](int n) { return n == 77; });
  }
  [[nodiscard]] bool has_marks() const {
    return xyz.back() == kMark && weights.back() == kMark && times_s.back() == kMark &&
           components.back() == 77 && no_return.back() == 77 && label_weights.back() == 77;
  }
};

inline tessera_semantic_cloud sample_cloud(std::int32_t points, bool weights, bool times) {
  tessera_semantic_cloud cloud;
  cloud.stamp_us = 0x0102030405060708;
  cloud.sensor = 3;
  cloud.count = points;
  cloud.coordinates = 3 * points;
  cloud.components = points;
  cloud.label_weights = 0;
  cloud.weights = weights ? points : 0;
  cloud.times = times ? points : 0;
  cloud.no_returns = weights ? points : 0;  // whatever has one has the other
  for (std::int32_t i = 0; i < points; ++i) {
    for (int axis = 0; axis < 3; ++axis)
      cloud.xyz.push_back(0.1F * static_cast<float>(i) - static_cast<float>(axis));
    cloud.component.push_back(static_cast<std::uint8_t>(i % 256));
    if (weights) cloud.weight.push_back(0.5F + static_cast<float>(i));
    if (times) cloud.time_us.push_back(100 * i - 5'000);
    if (weights) cloud.no_return.push_back(static_cast<std::uint8_t>(i % 2));
  }
  return cloud;
}

}  // namespace tessera
