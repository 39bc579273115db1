// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/registration/depth_image.hpp"

#include <cmath>

#include "tessera/semantics/class_table.hpp"

namespace tessera {

namespace {

constexpr int kMostStep = 64;
constexpr float kMostDepth_m = 1000.0F;

/// Written so that NaN fails.
bool valid(const DepthConfig& config) noexcept {
  return config.step_px >= 1 && config.step_px <= kMostStep && config.min_depth_m >= 0.0F &&
         config.min_depth_m <= config.max_depth_m && config.max_depth_m <= kMostDepth_m &&
         config.edge_m >= 0.0F && config.edge_share >= 0.0F && config.edge_share <= 100.0F &&
         (config.edge_m <= 100.0F || std::isinf(config.edge_m));
}

/// Metres; 0 where there is no depth.
float depth_at(const DepthImage& image, int column, int row) noexcept {
  const std::size_t pixel =
      static_cast<std::size_t>(row) * image.stride_pixels + static_cast<std::size_t>(column);
  if (image.millimetres != nullptr) return static_cast<float>(image.millimetres[pixel]) * 0.001F;
  const float depth_m = image.metres[pixel];
  return depth_m > 0.0F && std::isfinite(depth_m) ? depth_m : 0.0F;
}

bool valid(const DepthImage& image, int width_px) noexcept {
  const auto width = static_cast<std::size_t>(width_px);
  return (image.millimetres == nullptr) != (image.metres == nullptr) &&
         image.stride_pixels >= width &&
         (image.labels == nullptr || image.label_stride_bytes >= width);
}

struct Ray {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;
};

/// All 0 if nothing is seen there, or nothing that has a depth along the axis.
Ray ray_of(const CameraModel& model, DepthAlong along, int column, int row) noexcept {
  const Result<Point3d> direction =
      model.unproject({static_cast<double>(column), static_cast<double>(row)});
  if (!direction.ok()) return {};
  // 89.4 degrees, as for a pinhole: beyond, a depth along the axis says nothing.
  const bool aside = direction->z() * CameraModel::kWidestTangent < 1.0;
  if (along == DepthAlong::kAxis && aside) return {};
  const double length = along == DepthAlong::kAxis ? direction->z() : 1.0;
  return {round_to_float(direction->x() / length), round_to_float(direction->y() / length),
          round_to_float(direction->z() / length)};
}

/// 0 without labels.
std::uint8_t label_at(const DepthImage& image, int column, int row) noexcept {
  if (image.labels == nullptr) return 0;
  return image.labels[static_cast<std::size_t>(row) * image.label_stride_bytes +
                      static_cast<std::size_t>(column)];
}

}  // namespace

Result<DepthCamera> DepthCamera::make(Arena& arena, const CameraModel& model,
                                      const DepthConfig& config) noexcept {
  if (!valid(config) || model.width_px() < 1) return Status::kInvalidArgument;
  DepthCamera camera;
  camera.model_ = model;
  camera.config_ = config;
  camera.rays_ =
      arena.take<float>(3 * most_points(model.width_px(), model.height_px(), config.step_px));
  if (camera.rays_.empty()) return Status::kResourceExhausted;
  std::size_t next = 0;
  for (int row = 0; row < model.height_px(); row += config.step_px) {
    for (int column = 0; column < model.width_px(); column += config.step_px) {
      const Ray ray = ray_of(model, config.along, column, row);
      camera.rays_[next++] = ray.x;
      camera.rays_[next++] = ray.y;
      camera.rays_[next++] = ray.z;
    }
  }
  return camera;
}

bool DepthCamera::flying(const DepthImage& image, const Sample& sample) const noexcept {
  const auto [column, row, depth_m, ray] = sample;
  const float low_m = depth_m - (config_.edge_m + config_.edge_share * depth_m);
  const float high_m = depth_m + (config_.edge_m + config_.edge_share * depth_m);
  const auto between = [&](float a, float b) {
    // A missing neighbour says nothing.
    if (a == 0.0F || b == 0.0F) return false;
    return (a < low_m && b > high_m) || (b < low_m && a > high_m);
  };
  const bool in_row = column > 0 && column + 1 < model_.width_px() &&
                      between(depth_at(image, column - 1, row), depth_at(image, column + 1, row));
  return in_row || (row > 0 && row + 1 < model_.height_px() &&
                    between(depth_at(image, column, row - 1), depth_at(image, column, row + 1)));
}

std::uint32_t* DepthCamera::refusal(const DepthImage& image, const Sample& sample,
                                    DepthReport& report) const noexcept {
  if (sample.depth_m == 0.0F) return &report.no_depth;
  if (sample.depth_m < config_.min_depth_m) return &report.too_near;
  if (sample.depth_m > config_.max_depth_m) return &report.too_far;
  if (sample.ray[0] == 0.0F && sample.ray[1] == 0.0F && sample.ray[2] == 0.0F)
    return &report.no_ray;
  return flying(image, sample) ? &report.flying : nullptr;
}

DepthReport DepthCamera::to_points(const DepthImage& image, int num_classes,
                                   std::span<float> points,
                                   std::span<std::uint8_t> components) const noexcept {
  DepthReport report;
  if (rays_.empty()) {
    report.status = Status::kResourceExhausted;
    return report;
  }
  if (!valid(image, model_.width_px()) || num_classes < 1 || num_classes > kMaxClasses ||
      points.size() < rays_.size() || components.size() < most_points()) {
    report.status = Status::kInvalidArgument;
    return report;
  }
  Sample sample;
  sample.ray = rays_.data();
  for (sample.row = 0; sample.row < model_.height_px(); sample.row += config_.step_px) {
    for (sample.column = 0; sample.column < model_.width_px();
         sample.column += config_.step_px, sample.ray += 3) {
      sample.depth_m = depth_at(image, sample.column, sample.row);
      if (std::uint32_t* const refused = refusal(image, sample, report)) {
        ++*refused;
        continue;
      }
      const std::size_t i = report.points++;
      for (std::size_t axis = 0; axis < 3; ++axis)
        points[3 * i + axis] = sample.ray[axis] * sample.depth_m;
      const std::uint8_t label = label_at(image, sample.column, sample.row);
      const bool known = label >= 1 && label <= num_classes;
      report.unlabelled += known ? 0U : 1U;
      components[i] = known ? label : static_cast<std::uint8_t>(num_classes + 1);
    }
  }
  return report;
}

}  // namespace tessera
