// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels of camera images for the points of a scan: a point takes the label of the pixel that it
// projects to, unless the camera does not see it. As a camera is not at the scanner's place, the
// scanner sees things that are hidden from the camera behind others; a coarse image of the nearest
// ranges, made of the scan itself, tells which.
//
// A point is occluded if, by more than the tolerance, something nearer is in its own cell of that
// image, or on both sides of it within a few cells: to the left and to the right, above and below,
// or on both ends of a diagonal. So the gaps between a foreground's returns hide what is behind
// them, but what is beside a foreground or farther up on the same ground, with something nearer on
// one side only, is seen. What shows through a gap of the foreground that is narrower than the
// neighbourhood is lost: rather no label than a wrong one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/counters.hpp"
#include "tessera/registration/camera_model.hpp"
#include "tessera/registration/points_view.hpp"

namespace tessera {

inline constexpr std::size_t kMostCameras = 6;

/// A camera and its image. A view: the images stay the caller's and must outlive the call.
struct LabelCamera {
  CameraModel model;                                 ///< Has the size of the image.
  Matrix34d T_camera_lidar = Matrix34d::Identity();  ///< Lidar coordinates at the scan's stamp to
                                                     ///< the camera's at the image's.
  /// A byte a pixel: 1 .. C a class, any other value: unlabelled.
  const std::uint8_t* labels = nullptr;
  std::size_t row_stride_bytes = 0;  ///< At least the width.
  /// Where it is 0 the camera sees the robot itself, say, and labels nothing; null: nowhere.
  const std::uint8_t* mask = nullptr;
  std::size_t mask_stride_bytes = 0;  ///< At least the width.
};

/// Occlusion test and label selection.
struct LabelProjectionConfig {
  int cell_px = 2;      ///< Edge of the range image's cells, 1 .. 64.
  int reach_cells = 4;  ///< How far the neighbourhood goes to each side, 0 .. 16; 0: own cell only.
  /// Nearer by more than tolerance_m + tolerance_share * range occludes. 0 .. 100, 0 .. 1.
  float tolerance_m = 0.3F;
  float tolerance_share = 0.05F;
};

/// What a projector has memory for.
struct LabelProjectionCapacity {
  static constexpr std::uint32_t kMostPoints = std::uint32_t{1} << 24U;

  std::uint32_t points = 262144;  ///< Of a scan, 1 .. kMostPoints.
  int width_px = 1920;            ///< Of the largest image, 1 .. CameraModel::kMostPixels.
  int height_px = 1200;
};

/// Each finite point is in one of the counters.
#define TESSERA_LABEL_CAMERA_COUNTERS(ROW)                                     \
  ROW(COUNTER, uint32_t, behind, "Points behind the camera.")                  \
  ROW(COUNTER, uint32_t, outside,                                              \
      "Points beside the image, or beyond where the model is one-to-one.")     \
  ROW(COUNTER, uint32_t, masked, "Points in pixels that the mask excludes.")   \
  ROW(COUNTER, uint32_t, occluded, "Points that others occlude.")              \
  ROW(COUNTER, uint32_t, unknown, "Points in pixels whose value is no class.") \
  ROW(COUNTER, uint32_t, better_other,                                         \
      "Points that were seen, but another camera's label was taken.")          \
  ROW(COUNTER, uint32_t, labelled, "Points that have their label from this camera.")

/// What a camera did for a scan.
struct LabelCameraReport {
  /// kOk; else the camera was left out: kInvalidArgument iff it has no model or image, a stride is
  /// shorter than the image is wide, or T_camera_lidar is not rigid; kResourceExhausted iff the
  /// image is larger than the capacity.
  Status status = Status::kOk;
  TESSERA_LABEL_CAMERA_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(LabelCameraReport, TESSERA_LABEL_CAMERA_COUNTERS(TESSERA_COUNTER_ROW))

/// Of a scan, over all cameras.
#define TESSERA_LABEL_COUNTERS(ROW)                                                              \
  ROW(COUNTER, uint32_t, points, "Points of the scan.")                                          \
  ROW(COUNTER, uint32_t, non_finite, "Points that are not finite: the integrator refuses them.") \
  ROW(COUNTER, uint32_t, over_capacity, "Points beyond the capacity; they stay unlabelled.")     \
  ROW(COUNTER, uint32_t, labelled, "Points that a camera labelled.")                             \
  ROW(COUNTER, uint64_t, cells_read, "Cells of range images read by the occlusion test.")

/// What became of the points of a scan.
struct LabelReport {
  /// kOk, or kInvalidArgument iff there are more than kMostCameras, the classes are not 1 .. 62 or
  /// there is less room for components than points: then nothing was done.
  Status status = Status::kOk;
  TESSERA_LABEL_COUNTERS(TESSERA_COUNTER_MEMBER)
  std::array<LabelCameraReport, kMostCameras> cameras{};
};
TESSERA_COUNTER_TABLE(LabelReport, TESSERA_LABEL_COUNTERS(TESSERA_COUNTER_ROW))

/// Labels for a scan's points from the cameras' label images, in memory of an arena.
class LabelProjector {
 public:
  static constexpr int kMostCellPixels = 64;
  static constexpr int kMostReach = 16;

  /// For the arena. 17 bytes a point and 4 bytes a cell of one image, whatever the cameras.
  [[nodiscard]] static constexpr std::size_t required_bytes(
      const LabelProjectionCapacity& capacity, const LabelProjectionConfig& config) noexcept {
    return arena_bytes<Placed>(capacity.points) + arena_bytes<float>(capacity.points) +
           arena_bytes<std::uint8_t>(capacity.points) +
           arena_bytes<float>(cells(capacity.width_px, capacity.height_px, config.cell_px));
  }
  /// Fails with kInvalidArgument iff a number is out of its range, with kResourceExhausted iff the
  /// arena has no room. O(required_bytes).
  [[nodiscard]] static Result<LabelProjector> make(
      Arena& arena, const LabelProjectionConfig& config,
      const LabelProjectionCapacity& capacity) noexcept;
  LabelProjector() noexcept = default;  ///< Has room for no point.

  /// Sets components[i], i < points.count, to 1 .. num_classes or, if no camera labels the point,
  /// to num_classes + 1. Of several cameras that see a point in a pixel with a class, the one with
  /// the smallest angle between the point and its axis is taken, at the same angle the first.
  /// Worst case: for each camera its cells are cleared, and for each point one projection and
  /// 1 + 8 reach_cells reads of cells.
  LabelReport project(const PointsView& points, std::span<const LabelCamera> cameras,
                      int num_classes, std::span<std::uint8_t> components) noexcept;

 private:
  /// Where a camera sees a point.
  struct Placed {
    std::uint16_t column = kNowhere;
    std::uint16_t row = 0;
    float range_m = 0.0F;
    float cosine = 0.0F;  ///< Of the angle to the camera's axis.
  };
  static constexpr std::uint16_t kNowhere = 0xffff;

  /// The range image of one camera.
  struct Cells {
    int columns = 0;
    int rows = 0;
  };
  /// A point's place in it, and what is nearer than the point by more than the tolerance.
  struct Probe {
    int column = 0;
    int row = 0;
    float nearer_than_m = 0.0F;
  };

  static constexpr int cells_across(int pixels, int cell_px) noexcept {
    return (pixels + cell_px - 1) / cell_px;
  }
  static constexpr std::size_t cells(int width_px, int height_px, int cell_px) noexcept {
    return static_cast<std::size_t>(cells_across(width_px, cell_px)) *
           static_cast<std::size_t>(cells_across(height_px, cell_px));
  }

  [[nodiscard]] Status check(const LabelCamera& camera) const noexcept;
  /// pixel / cell_px without a division: exact for pixels up to 2^14 and cells up to 64.
  [[nodiscard]] int cell_of(std::uint16_t pixel) const noexcept {
    return static_cast<int>((pixel * cells_per_pixel_) >> kShift);
  }
  void place(const PointsView& points, const LabelCamera& camera,
             LabelCameraReport& report) noexcept;
  void take_labels(const LabelCamera& camera, std::size_t number, int num_classes,
                   std::span<std::uint8_t> components, LabelReport& report) noexcept;
  [[nodiscard]] float cell_m(const Probe& probe) noexcept;
  [[nodiscard]] bool nearer_along(const Probe& probe, int columns, int rows) noexcept;
  [[nodiscard]] bool occluded(const Placed& placed) noexcept;

  LabelProjectionConfig config_{};
  LabelProjectionCapacity capacity_{};
  std::span<Placed> placed_;
  std::span<float> best_cosine_;
  std::span<std::uint8_t> camera_;  ///< That a point has its label from.
  std::span<float> nearest_m_;
  Cells cells_{};
  std::size_t count_ = 0;
  static constexpr unsigned kShift = 26;
  std::uint64_t cells_per_pixel_ = 0;  ///< Times 2^kShift, rounded up.
  std::uint64_t cells_read_ = 0;
};

}  // namespace tessera
