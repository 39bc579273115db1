// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/scan.hpp"

#include <algorithm>

#include "tessera/base/assert.hpp"

namespace tessera {

void UnknownRawIds::add(std::uint16_t raw_id) noexcept {
  ++points;
  const auto end = examples.begin() + static_cast<std::ptrdiff_t>(num_examples);
  if (num_examples < kMaxExamples && std::find(examples.begin(), end, raw_id) == end) {
    examples[num_examples++] = raw_id;
  }
}

Scan::Scan(const ScanLimits& limits)
    : limits_(limits),
      images_(std::make_unique<std::uint8_t[]>(limits.cameras * limits.image_pixels)) {
  allocate_points();
  for (std::size_t i = 0; i < limits.cameras; ++i)
    image_memory[i].memory = {images_.get() + i * limits.image_pixels, limits.image_pixels};
}

void Scan::allocate_points() {
  points_ = std::make_unique<float[]>(limits_.floats_per_point * limits_.points);
  if (limits_.weights) weights_ = std::make_unique<float[]>(limits_.points);
  times_s_ = std::make_unique<float[]>(limits_.points);
  components_ = std::make_unique<std::uint8_t[]>(components().size());
  if (limits_.weighted_labels > 0)
    label_weights_ = std::make_unique<std::uint8_t[]>(label_weights().size());
  if (limits_.no_returns) no_return_ = std::make_unique<std::uint8_t[]>(limits_.points);
}

void Scan::reserve(std::size_t points, std::size_t weighted_labels) {
  if (points <= limits_.points && weighted_labels <= limits_.weighted_labels) return;
  limits_.points = std::max(points, limits_.points);
  limits_.weighted_labels = std::max(weighted_labels, limits_.weighted_labels);
  points_.reset();  // So that old and new memory are not held at the same time.
  times_s_.reset();
  components_.reset();
  label_weights_.reset();
  no_return_.reset();
  allocate_points();
}

void Scan::become_cloud(const ScanView& view) {
  TESSERA_ASSERT(view.labels_per_point == 1 && view.label_weights == nullptr);
  reserve(view.count);
  kind = ScanKind::kCloud;
  count = static_cast<std::uint32_t>(view.count);
  has_components = view.components != nullptr;
  labels_per_point = 1;
  has_label_weights = has_weights = has_times = has_no_return = false;
  num_images = 0;
  for (std::size_t i = 0; i < view.count; ++i)
    std::copy_n(view.points + i * view.stride_floats, 3,
                points_.get() + i * limits_.floats_per_point);
  if (has_components) std::copy_n(view.components, view.count, components_.get());
}

void Scan::clear() noexcept {
  kind = ScanKind::kCloud;
  sensor = number = 0;
  stamp_us = taken_us = 0;
  count = 0;
  width_px = height_px = 0;
  has_components = has_weights = has_times = has_no_return = images_missing = false;
  labels_per_point = 1;
  has_label_weights = false;
  first_us = last_us = 0;
  T_body_sensor = T_map_body = T_map_sensor = Matrix34d::Identity();
  num_images = num_poses = 0;
  track = nullptr;
  unknown = {};
}

}  // namespace tessera
