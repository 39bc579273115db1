// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A sweep or a depth image for the mapping thread: the measurement, its label images, and the poses
// of the robot. Its memory is allocated at the start and reused.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tessera/base/geometry.hpp"
#include "tessera/registration/pose_track.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

struct SlotCapacity {
  std::size_t points = 131'072;          ///< Of a cloud; a third of the pixels of a depth image.
  std::size_t cameras = 0;               ///< Label images of a slot, 0 .. ScanSlot::kMostCameras.
  std::size_t image_pixels = 1'228'800;  ///< Of each label image: 1280 x 960.
};

enum class SlotKind : std::uint8_t { kCloud, kDepthImage };

/// A label image of a slot. A byte per pixel, row by row: 1 .. C a class, any other: unlabelled.
struct SlotImage {
  std::int32_t camera = 0;  ///< Its number in messages.
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  std::int64_t stamp_us = 0;
  std::span<std::uint8_t> memory{};

  [[nodiscard]] std::span<const std::uint8_t> components() const noexcept {
    return memory.first(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  }
};

class ScanSlot {
 public:
  static constexpr std::size_t kMostCameras = 6;
  static constexpr std::size_t kMostPoses = 64;

  /// Without memory: holds nothing.
  ScanSlot() noexcept = default;
  explicit ScanSlot(const SlotCapacity& capacity);
  /// Bytes that a slot allocates on the heap.
  [[nodiscard]] static constexpr std::size_t required_bytes(const SlotCapacity& capacity) noexcept {
    return capacity.points * (5 * sizeof(float) + 1) + capacity.cameras * capacity.image_pixels;
  }

  // Set by the sensing thread; the mapping thread may change anything until it pops the slot.
  SlotKind kind = SlotKind::kCloud;
  std::int32_t sensor = 0;    ///< Number of the sensor, or of the depth camera.
  std::int64_t stamp_us = 0;  ///< Of the sweep or image.
  std::int64_t taken_us = 0;  ///< Time of arrival, monotonic: for latencies.
  std::uint32_t count = 0;    ///< Points of a cloud.
  std::int32_t width_px = 0;  ///< Of a depth image; its labels are images()[0], if it has any.
  std::int32_t height_px = 0;
  bool has_components = false;  ///< If false, components() are invalid: label points by the images.
  bool has_weights = false;
  bool has_times = false;
  bool images_missing = false;  ///< A required camera has no image here.
  std::int32_t first_us = 0;    ///< Of the points' times, relative to the stamp.
  std::int32_t last_us = 0;
  Matrix34d T_body_sensor = Matrix34d::Identity();
  Matrix34d T_map_body = Matrix34d::Identity();    ///< At the stamp.
  Matrix34d T_map_sensor = Matrix34d::Identity();  ///< At the stamp.
  std::size_t num_images = 0;
  /// From before the sweep and its images to after them, rising; evenly thinned if there are too
  /// many.
  std::size_t num_poses = 0;
  std::array<StampedPose, kMostPoses> pose_memory{};
  std::array<SlotImage, kMostCameras> image_memory{};

  [[nodiscard]] std::span<const StampedPose> poses() const noexcept {
    return std::span(pose_memory).first(num_poses);
  }
  [[nodiscard]] std::span<const SlotImage> images() const noexcept {
    return std::span(image_memory).first(num_images);
  }
  /// The whole capacity; of a cloud only the first 3 * count, count, ... are valid.
  [[nodiscard]] std::span<float> xyz() noexcept { return {xyz_.get(), 3 * capacity_.points}; }
  [[nodiscard]] std::span<std::uint8_t> components() noexcept {
    return {components_.get(), capacity_.points};
  }
  [[nodiscard]] std::span<float> weights() noexcept { return {weights_.get(), capacity_.points}; }
  [[nodiscard]] std::span<float> times_s() noexcept { return {times_s_.get(), capacity_.points}; }
  /// Of a depth image: metres per pixel, row by row; uses the memory of xyz().
  [[nodiscard]] std::span<const float> depth_m() const noexcept {
    return {xyz_.get(), static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)};
  }
  /// A cloud as input of the integrator, at its stamp: not deskewed, labelled iff has_components.
  [[nodiscard]] ScanView view() const noexcept {
    return {.T_map_sensor = T_map_sensor,
            .points = xyz_.get(),
            .stride_floats = 3,
            .count = count,
            .components = has_components ? components_.get() : nullptr,
            .weights = has_weights ? weights_.get() : nullptr};
  }
  [[nodiscard]] const SlotCapacity& capacity() const noexcept { return capacity_; }

 private:
  SlotCapacity capacity_{.points = 0, .cameras = 0, .image_pixels = 0};
  std::unique_ptr<float[]> xyz_;
  std::unique_ptr<float[]> weights_;
  std::unique_ptr<float[]> times_s_;
  std::unique_ptr<std::uint8_t[]> components_;
  std::unique_ptr<std::uint8_t[]> images_;
};

inline ScanSlot::ScanSlot(const SlotCapacity& capacity)
    : capacity_(capacity),
      xyz_(std::make_unique<float[]>(3 * capacity.points)),
      weights_(std::make_unique<float[]>(capacity.points)),
      times_s_(std::make_unique<float[]>(capacity.points)),
      components_(std::make_unique<std::uint8_t[]>(capacity.points)),
      images_(std::make_unique<std::uint8_t[]>(capacity.cameras * capacity.image_pixels)) {
  for (std::size_t i = 0; i < capacity.cameras; ++i)
    image_memory[i].memory = {images_.get() + i * capacity.image_pixels, capacity.image_pixels};
}

}  // namespace tessera
