// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Points of a depth camera, with the labels of its segmented image: what robots without a laser
// scanner map with.
//
// At the border of an object a depth camera mixes what is before and behind it, and gives "flying"
// pixels at a depth where nothing is. A pixel is refused as flying if, in its row or in its column,
// one neighbour is nearer and the opposite one farther, each by more than the tolerance. A border
// pixel that lies on either side of the edge has such a neighbour on one side only, and stays. So
// does what slopes less than the tolerance a pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/counters.hpp"
#include "tessera/registration/camera_model.hpp"

namespace tessera {

/// What a depth is measured along.
enum class DepthAlong : std::uint8_t {
  kAxis = 0,  ///< The camera's axis: Z, as most depth cameras give it.
  kRay = 1,   ///< The pixel's ray: the distance.
};

/// Depths and, if there are any, labels of the same pixels. A view: the images stay the caller's.
struct DepthImage {
  /// One of the two; in whole millimetres or in metres. 0, NaN and infinity: no depth.
  const std::uint16_t* millimetres = nullptr;
  const float* metres = nullptr;
  std::size_t stride_pixels = 0;         ///< From row to row, at least the width.
  const std::uint8_t* labels = nullptr;  ///< 1 .. C, else unlabelled; null: all unlabelled.
  std::size_t label_stride_bytes = 0;    ///< At least the width.
};

/// Which pixels of a depth image become points.
struct DepthConfig {
  DepthAlong along = DepthAlong::kAxis;
  int step_px = 2;            ///< Uses every step_px-th pixel and row, 1 .. 64.
  float min_depth_m = 0.2F;   ///< 0 .. max_depth_m.
  float max_depth_m = 10.0F;  ///< Up to 1000.
  float edge_m = 0.03F;       ///< Tolerance of flying pixels: edge_m + edge_share * depth.
  float edge_share = 0.02F;   ///< Both 0 .. 100; infinity in edge_m lets all pixels through.
};

/// Each sampled pixel is in one of the first six.
#define TESSERA_DEPTH_COUNTERS(ROW)                                                \
  ROW(COUNTER, uint32_t, points, "Sampled pixels that became points.")             \
  ROW(COUNTER, uint32_t, no_depth, "Sampled pixels without depth.")                \
  ROW(COUNTER, uint32_t, too_near, "Sampled pixels nearer than the least depth.")  \
  ROW(COUNTER, uint32_t, too_far, "Sampled pixels beyond the greatest depth.")     \
  ROW(COUNTER, uint32_t, flying, "Sampled pixels at the edges of depths.")         \
  ROW(COUNTER, uint32_t, no_ray, "Sampled pixels in which the lens sees nothing.") \
  ROW(COUNTER, uint32_t, unlabelled, "Of the points, those without a class.")

/// What became of the pixels of a depth image.
struct DepthReport {
  /// kOk; else nothing was done: kInvalidArgument iff there is not exactly one depth image, a
  /// stride is shorter than the width, the classes are not 1 .. 62, or the output has no room for
  /// most_points(); kResourceExhausted iff the object was not made.
  Status status = Status::kOk;
  TESSERA_DEPTH_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(DepthReport, TESSERA_DEPTH_COUNTERS(TESSERA_COUNTER_ROW))

/// The rays of a camera's sampled pixels, found once.
class DepthCamera {
 public:
  [[nodiscard]] static constexpr std::size_t most_points(int width_px, int height_px,
                                                         int step_px) noexcept {
    return static_cast<std::size_t>((width_px + step_px - 1) / step_px) *
           static_cast<std::size_t>((height_px + step_px - 1) / step_px);
  }
  /// For the arena: 12 bytes a sampled pixel.
  [[nodiscard]] static constexpr std::size_t required_bytes(int width_px, int height_px,
                                                            int step_px) noexcept {
    return arena_bytes<float>(3 * most_points(width_px, height_px, step_px));
  }
  /// Fails with kInvalidArgument iff the model has no image, or a configured number is out of its
  /// range; with kResourceExhausted iff the arena has no room. One unproject() a sampled pixel.
  [[nodiscard]] static Result<DepthCamera> make(Arena& arena, const CameraModel& model,
                                                const DepthConfig& config) noexcept;
  DepthCamera() noexcept = default;  ///< Gives no points.

  [[nodiscard]] std::size_t most_points() const noexcept { return rays_.size() / 3; }
  /// Writes x y z (metres, camera frame: x right, y down, z forward) of point i to points[3 i ..]
  /// and its component, 1 .. num_classes or num_classes + 1, to components[i], by rows. Needs room
  /// for most_points(). The same bits on every machine. O(sampled pixels): five depths are read for
  /// each.
  DepthReport to_points(const DepthImage& image, int num_classes, std::span<float> points,
                        std::span<std::uint8_t> components) const noexcept;

 private:
  struct Sample {
    int column = 0;
    int row = 0;
    float depth_m = 0.0F;
    const float* ray = nullptr;
  };
  /// The counter of a pixel that gives no point; null if it does.
  [[nodiscard]] std::uint32_t* refusal(const DepthImage& image, const Sample& sample,
                                       DepthReport& report) const noexcept;
  [[nodiscard]] bool flying(const DepthImage& image, const Sample& sample) const noexcept;

  CameraModel model_;
  DepthConfig config_{};
  /// By rows; of length 1, or with z = 1 for depths along the axis. All 0: sees nothing.
  std::span<float> rays_;
};

}  // namespace tessera
