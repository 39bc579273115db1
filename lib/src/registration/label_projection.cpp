// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/registration/label_projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tessera/base/rigid.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

namespace {

constexpr float kNothing_m = std::numeric_limits<float>::infinity();
constexpr std::uint8_t kNoCamera = 0xff;
/// Under the cosine of any angle.
constexpr float kNoCosine = -2.0F;

bool valid(const LabelProjectionConfig& config, const LabelProjectionCapacity& capacity) noexcept {
  const auto side = [](int pixels) { return pixels >= 1 && pixels <= CameraModel::kMostPixels; };
  return config.cell_px >= 1 && config.cell_px <= LabelProjector::kMostCellPixels &&
         config.reach_cells >= 0 && config.reach_cells <= LabelProjector::kMostReach &&
         config.tolerance_m >= 0.0F && config.tolerance_m <= 100.0F &&
         config.tolerance_share >= 0.0F && config.tolerance_share <= 1.0F && capacity.points >= 1 &&
         capacity.points <= LabelProjectionCapacity::kMostPoints && side(capacity.width_px) &&
         side(capacity.height_px);
}

Point3d at(const PointsView& points, std::size_t i) noexcept {
  const float* const p = points.points + i * points.stride_floats;
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

/// From -0.5 on, so that cutting off the fraction is rounding down. The sum may be rounded up: that
/// of 0.5 and the number before it is 1, so a place in the image is not always under its side.
std::uint16_t nearest_pixel(double place, int side_px) noexcept {
  const double from_edge = place + 0.5;
  return static_cast<std::uint16_t>(std::min(static_cast<int>(from_edge), side_px - 1));
}

/// The square of a finite float does not overflow a double. Written so that NaN fails.
bool finite(const Point3d& p) noexcept { return squared_norm(p) < 1e300; }

}  // namespace

Result<LabelProjector> LabelProjector::make(Arena& arena, const LabelProjectionConfig& config,
                                            const LabelProjectionCapacity& capacity) noexcept {
  if (!valid(config, capacity)) return Status::kInvalidArgument;
  if (arena.remaining_bytes() < required_bytes(capacity, config)) return Status::kResourceExhausted;
  LabelProjector projector;
  projector.config_ = config;
  projector.capacity_ = capacity;
  projector.cells_per_pixel_ =
      (std::uint64_t{1} << kShift) / static_cast<std::uint64_t>(config.cell_px) + 1;
  projector.placed_ = arena.take<Placed>(capacity.points);
  projector.best_cosine_ = arena.take<float>(capacity.points);
  projector.camera_ = arena.take<std::uint8_t>(capacity.points);
  projector.nearest_m_ =
      arena.take<float>(cells(capacity.width_px, capacity.height_px, config.cell_px));
  return projector;
}

Status LabelProjector::check(const LabelCamera& camera) const noexcept {
  const auto width = static_cast<std::size_t>(camera.model.width_px());
  const bool image = width > 0 && camera.labels != nullptr && camera.row_stride_bytes >= width;
  const bool mask = camera.mask == nullptr || camera.mask_stride_bytes >= width;
  if (!image || !mask) return Status::kInvalidArgument;
  if (check_rigid(camera.T_camera_lidar) != Status::kOk) return Status::kInvalidArgument;
  const std::size_t needed =
      cells(camera.model.width_px(), camera.model.height_px(), config_.cell_px);
  return needed <= nearest_m_.size() ? Status::kOk : Status::kResourceExhausted;
}

void LabelProjector::place(const PointsView& points, const LabelCamera& camera,
                           LabelCameraReport& report) noexcept {
  cells_ = {cells_across(camera.model.width_px(), config_.cell_px),
            cells_across(camera.model.height_px(), config_.cell_px)};
  std::ranges::fill(nearest_m_.first(static_cast<std::size_t>(cells_.columns) *
                                     static_cast<std::size_t>(cells_.rows)),
                    kNothing_m);
  for (std::size_t i = 0; i < count_; ++i) {
    Placed& placed = placed_[i];
    placed.column = kNowhere;
    const Point3d p_lidar = at(points, i);
    if (!finite(p_lidar)) continue;
    const Point3d p_camera = apply(camera.T_camera_lidar, p_lidar);
    Pixel pixel;
    const Sight sight = camera.model.project(p_camera, pixel);
    report.behind += sight == Sight::kBehind ? 1U : 0U;
    report.outside += sight == Sight::kOutside ? 1U : 0U;
    if (sight != Sight::kSeen) continue;
    const double range_m = norm(p_camera);
    placed.column = nearest_pixel(pixel.column, camera.model.width_px());
    placed.row = nearest_pixel(pixel.row, camera.model.height_px());
    placed.range_m = round_to_float(range_m);
    placed.cosine = round_to_float(p_camera.z() / range_m);
    float& nearest_m = nearest_m_[static_cast<std::size_t>(cell_of(placed.row) * cells_.columns +
                                                           cell_of(placed.column))];
    nearest_m = std::min(nearest_m, placed.range_m);
  }
}

float LabelProjector::cell_m(const Probe& probe) noexcept {
  ++cells_read_;
  return nearest_m_[static_cast<std::size_t>(probe.row * cells_.columns + probe.column)];
}

/// Whether something nearer is within reach of the probe, going by (columns, rows) a step.
bool LabelProjector::nearer_along(const Probe& probe, int columns, int rows) noexcept {
  Probe there = probe;
  for (int step = 0; step < config_.reach_cells; ++step) {
    there.column += columns;
    there.row += rows;
    if (there.column < 0 || there.column >= cells_.columns || there.row < 0 ||
        there.row >= cells_.rows)
      return false;
    if (cell_m(there) < probe.nearer_than_m) return true;
  }
  return false;
}

bool LabelProjector::occluded(const Placed& placed) noexcept {
  const Probe probe{
      cell_of(placed.column), cell_of(placed.row),
      placed.range_m - (config_.tolerance_m + config_.tolerance_share * placed.range_m)};
  if (cell_m(probe) < probe.nearer_than_m) return true;
  struct Direction {
    int columns;
    int rows;
  };
  constexpr std::array<Direction, 4> kDirections{{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  return std::ranges::any_of(kDirections, [&](const Direction& to) {
    return nearer_along(probe, to.columns, to.rows) && nearer_along(probe, -to.columns, -to.rows);
  });
}

void LabelProjector::take_labels(const LabelCamera& camera, std::size_t number, int num_classes,
                                 std::span<std::uint8_t> components, LabelReport& report) noexcept {
  LabelCameraReport& own = report.cameras[number];
  for (std::size_t i = 0; i < count_; ++i) {
    const Placed& placed = placed_[i];
    if (placed.column == kNowhere) continue;
    if (camera.mask != nullptr &&
        camera.mask[placed.row * camera.mask_stride_bytes + placed.column] == 0) {
      ++own.masked;
      continue;
    }
    if (occluded(placed)) {
      ++own.occluded;
      continue;
    }
    const std::uint8_t label = camera.labels[placed.row * camera.row_stride_bytes + placed.column];
    if (label < 1 || label > num_classes) {
      ++own.unknown;
      continue;
    }
    if (placed.cosine <= best_cosine_[i]) {
      ++own.better_other;
      continue;
    }
    if (camera_[i] != kNoCamera) {
      LabelCameraReport& other = report.cameras[camera_[i]];
      --other.labelled;
      ++other.better_other;
    }
    ++own.labelled;
    camera_[i] = static_cast<std::uint8_t>(number);
    best_cosine_[i] = placed.cosine;
    components[i] = label;
  }
}

LabelReport LabelProjector::project(const PointsView& points, std::span<const LabelCamera> cameras,
                                    int num_classes, std::span<std::uint8_t> components) noexcept {
  LabelReport report;
  if (cameras.size() > kMostCameras || num_classes < 1 || num_classes > kMaxClasses ||
      components.size() < points.count || points.stride_floats < 3) {
    report.status = Status::kInvalidArgument;
    return report;
  }
  report.points = static_cast<std::uint32_t>(points.count);
  count_ = std::min(points.count, placed_.size());
  report.over_capacity = static_cast<std::uint32_t>(points.count - count_);
  cells_read_ = 0;
  std::ranges::fill(components.first(points.count), static_cast<std::uint8_t>(num_classes + 1));
  std::ranges::fill(best_cosine_.first(count_), kNoCosine);
  std::ranges::fill(camera_.first(count_), kNoCamera);
  for (std::size_t i = 0; i < count_; ++i) report.non_finite += finite(at(points, i)) ? 0U : 1U;
  for (std::size_t number = 0; number < cameras.size(); ++number) {
    LabelCameraReport& camera = report.cameras[number];
    camera.status = check(cameras[number]);
    if (camera.status != Status::kOk) continue;
    place(points, cameras[number], camera);
    take_labels(cameras[number], number, num_classes, components, report);
  }
  for (std::size_t number = 0; number < cameras.size(); ++number)
    report.labelled += report.cameras[number].labelled;
  report.cells_read = cells_read_;
  return report;
}

}  // namespace tessera
