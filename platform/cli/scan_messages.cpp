// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/scan_messages.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "link/sensor_sender.hpp"

namespace tessera {
namespace {

/// Packed x y z of the points of a cloud.
std::vector<float> packed(Scan& scan) {
  const std::size_t stride = scan.limits().floats_per_point;
  std::vector<float> xyz(std::size_t{3} * scan.count);
  for (std::size_t i = 0; i < scan.count; ++i)
    std::copy_n(scan.points().data() + i * stride, 3, xyz.data() + 3 * i);
  return xyz;
}

}  // namespace

bool is_semantic(const Scan& scan, const ScanToSend& how) noexcept {
  return how.semantic && scan.count > 0;
}

Outcome<std::vector<std::byte>> cloud_message(Scan& scan, const ScanToSend& how) {
  const std::vector<float> xyz = packed(scan);
  CloudToSend cloud{.stamp_us = how.stamp_us, .sensor = how.sensor, .xyz = xyz};
  const std::size_t timed = !how.semantic && scan.has_times ? scan.count : 0;
  std::vector<std::int32_t> times_us;
  times_us.reserve(timed);
  for (const float time_s : scan.times_s().first(timed)) {
    const double us = 1e6 * how.stretch * static_cast<double>(time_s);
    if (!(std::abs(us) <= kMostSweep_us)) {
      return Failure{
          fmt::format("scan {} has points over a second from its stamp, played at this rate; give "
                      "a higher --rate",
                      scan.number)};
    }
    times_us.push_back(static_cast<std::int32_t>(std::lround(us)));
  }
  cloud.times_us = times_us;
  if (scan.has_no_return) cloud.no_return = scan.no_return().first(scan.count);
  const std::size_t labels = scan.labels_per_point * scan.count;
  if (is_semantic(scan, how)) {
    cloud.components = scan.components().first(labels);
    if (scan.has_label_weights) cloud.label_weights = scan.label_weights().first(labels);
  }
  return encode(cloud);
}

std::vector<std::byte> depth_message(const Scan& scan, const ScanToSend& how) {
  return encode(DepthToSend{.header = {.stamp_us = how.stamp_us,
                                       .camera = how.sensor,
                                       .width_px = scan.width_px,
                                       .height_px = scan.height_px},
                            .depth_m = scan.depth_m()});
}

std::vector<std::byte> label_message(const ScanImage& image, std::int64_t stamp_us,
                                     std::int32_t camera) {
  return encode(ImageToSend{.header = {.stamp_us = stamp_us,
                                       .camera = camera,
                                       .width_px = image.width_px,
                                       .height_px = image.height_px},
                            .components = image.components()});
}

}  // namespace tessera
