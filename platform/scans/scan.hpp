// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A scan in memory, of a sensor or of a file: the measurement, its label images, and the poses of
// the robot. Its memory is allocated once and reused.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "tessera/registration/points_view.hpp"
#include "tessera/registration/pose_track.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// Poses farther apart than this are not interpolated to place an image or a recorded point.
inline constexpr std::int64_t kMaxPoseGap_us = 250'000;

/// The largest scan that fits.
struct ScanLimits {
  std::size_t points = 131'072;  ///< Of a cloud; of a depth image, its pixels / floats_per_point.
  std::size_t cameras = 0;       ///< Label images, 0 .. Scan::kMostCameras.
  std::size_t image_pixels = 1'228'800;  ///< Of each label image: 1280 x 960.
  std::size_t floats_per_point = 3;      ///< 3: x y z; 4: and an intensity.
  bool weights = true;                   ///< Whether points may have weights.
  bool no_returns = false;               ///< Whether points may be directions without a return.
  std::size_t weighted_labels = 0;  ///< Labels with weights that a point may have; 0: one without.

  friend constexpr bool operator==(const ScanLimits&, const ScanLimits&) = default;
};

enum class ScanKind : std::uint8_t { kCloud, kDepthImage };

/// A label image of a scan. A byte per pixel, row by row: 1 .. C a class, any other: unlabelled.
struct ScanImage {
  std::int32_t camera = 0;  ///< Its number in messages, or in cameras.toml.
  std::int32_t width_px = 0;
  std::int32_t height_px = 0;
  std::int64_t stamp_us = 0;
  std::span<std::uint8_t> memory{};

  [[nodiscard]] std::span<const std::uint8_t> components() const noexcept {
    return memory.first(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  }
};

/// Raw label ids that the classes do not know, in one scan.
struct UnknownRawIds {
  static constexpr std::size_t kMaxExamples = 8;

  std::uint64_t points = 0;
  std::array<std::uint16_t, kMaxExamples>
      examples{};  ///< Different ids, in the order of their appearance.
  std::size_t num_examples = 0;

  void add(std::uint16_t raw_id) noexcept;
};

class Scan {
 public:
  static constexpr std::size_t kMostCameras = 6;
  static constexpr std::size_t kMostPoses = 64;

  /// Without memory: holds nothing.
  Scan() noexcept = default;
  explicit Scan(const ScanLimits& limits);
  /// Bytes that a scan allocates on the heap.
  [[nodiscard]] static constexpr std::size_t required_bytes(const ScanLimits& limits) noexcept {
    const std::size_t floats = limits.floats_per_point + 1 + (limits.weights ? 1U : 0U);
    const std::size_t flags = limits.no_returns ? 1 : 0;
    return limits.points *
               (floats * sizeof(float) + labels(limits) + limits.weighted_labels + flags) +
           limits.cameras * limits.image_pixels;
  }
  /// Grows if it holds fewer points, or fewer labels with weights of each, whose values are lost
  /// then; never shrinks. For recorded scans only: a live source uses no heap after its start.
  void reserve(std::size_t points, std::size_t weighted_labels = 0);

  // Set by the source; the user may change anything until it pops the scan.
  ScanKind kind = ScanKind::kCloud;
  std::int32_t sensor = 0;    ///< Number of the sensor, or of the depth camera.
  std::int32_t number = 0;    ///< Of a recorded scan.
  std::int64_t stamp_us = 0;  ///< Of the sweep or image; 0 if a recording has no times.
  std::int64_t taken_us = 0;  ///< Time of arrival, monotonic: for latencies.
  std::uint32_t count = 0;    ///< Points of a cloud.
  std::int32_t width_px = 0;  ///< Of a depth image; its labels are images()[0], if it has any.
  std::int32_t height_px = 0;
  bool has_components = false;  ///< If false, components() are invalid: label points by the images.
  std::size_t labels_per_point = 1;  ///< Of components().
  bool has_label_weights = false;    ///< If not, a point has one label.
  bool has_weights = false;
  bool has_times = false;
  bool has_no_return = false;   ///< Some points may be directions: no_return() is not 0.
  bool images_missing = false;  ///< A required camera has no image here.
  std::int32_t first_us = 0;    ///< Of the points' times, relative to the stamp.
  std::int32_t last_us = 0;
  Matrix34d T_body_sensor = Matrix34d::Identity();
  Matrix34d T_map_body = Matrix34d::Identity();    ///< At the stamp.
  Matrix34d T_map_sensor = Matrix34d::Identity();  ///< At the stamp. As recorded: may be not rigid.
  std::size_t num_images = 0;
  /// From before the sweep and its images to after them, rising; evenly thinned if there are too
  /// many.
  std::size_t num_poses = 0;
  const PoseTrack* track = nullptr;  ///< All poses of a recording, instead of poses(); or null.
  UnknownRawIds unknown{};           ///< Of a recorded scan.
  std::array<StampedPose, kMostPoses> pose_memory{};
  std::array<ScanImage, kMostCameras> image_memory{};

  /// Becomes a cloud of these points, of one label each, which may not be its own. Reserves memory
  /// for them.
  void become_cloud(const ScanView& view);
  /// Clears what the members above say of another scan.
  void clear() noexcept;

  [[nodiscard]] std::span<const StampedPose> poses() const noexcept {
    return std::span(pose_memory).first(num_poses);
  }
  [[nodiscard]] std::span<const ScanImage> images() const noexcept {
    return std::span(image_memory).first(num_images);
  }
  /// The whole capacity; of a cloud only the first floats_per_point * count, labels_per_point *
  /// count, count, ... are valid.
  [[nodiscard]] std::span<float> points() noexcept {
    return {points_.get(), limits_.floats_per_point * limits_.points};
  }
  [[nodiscard]] std::span<std::uint8_t> components() noexcept {
    return {components_.get(), labels(limits_) * limits_.points};
  }
  [[nodiscard]] std::span<std::uint8_t> label_weights() noexcept {
    return {label_weights_.get(), limits_.weighted_labels * limits_.points};
  }
  [[nodiscard]] std::span<float> weights() noexcept {
    return {weights_.get(), limits_.weights ? limits_.points : 0};
  }
  [[nodiscard]] std::span<std::uint8_t> no_return() noexcept {
    return {no_return_.get(), limits_.no_returns ? limits_.points : 0};
  }
  [[nodiscard]] std::span<float> times_s() noexcept { return {times_s_.get(), limits_.points}; }
  [[nodiscard]] std::span<const float> times_s() const noexcept {
    return {times_s_.get(), limits_.points};
  }
  /// Of a depth image: metres per pixel, row by row; uses the memory of points().
  [[nodiscard]] std::span<const float> depth_m() const noexcept {
    return {points_.get(),
            static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)};
  }
  [[nodiscard]] PointsView points_view() const noexcept {
    return {points_.get(), limits_.floats_per_point, count};
  }
  /// A cloud as input of the integrator, at its stamp: not deskewed, labelled iff has_components.
  [[nodiscard]] ScanView view() const noexcept {
    return {.T_map_sensor = T_map_sensor,
            .points = points_.get(),
            .stride_floats = limits_.floats_per_point,
            .count = count,
            .components = has_components ? components_.get() : nullptr,
            .weights = has_weights ? weights_.get() : nullptr,
            .T_body_sensor = T_body_sensor,
            .no_return = has_no_return ? no_return_.get() : nullptr,
            .labels_per_point = labels_per_point,
            .label_weights = has_label_weights ? label_weights_.get() : nullptr};
  }
  [[nodiscard]] const ScanLimits& limits() const noexcept { return limits_; }

 private:
  /// Of each point, with memory.
  [[nodiscard]] static constexpr std::size_t labels(const ScanLimits& limits) noexcept {
    return limits.weighted_labels > 1 ? limits.weighted_labels : 1;
  }
  void allocate_points();

  ScanLimits limits_{.points = 0, .cameras = 0, .image_pixels = 0};
  std::unique_ptr<float[]> points_;
  std::unique_ptr<float[]> weights_;
  std::unique_ptr<float[]> times_s_;
  std::unique_ptr<std::uint8_t[]> components_;
  std::unique_ptr<std::uint8_t[]> label_weights_;
  std::unique_ptr<std::uint8_t[]> no_return_;
  std::unique_ptr<std::uint8_t[]> images_;
};

}  // namespace tessera
