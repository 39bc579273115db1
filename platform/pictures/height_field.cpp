// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/height_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pictures/canvas.hpp"

namespace tessera {
namespace {

constexpr float kGroundCell_m = 2.0F;
constexpr int kGroundReach = 2;
constexpr int kMostCellsOfEdge = 1 << 14;

constexpr std::array<CellStep, 8> kAround = {
    {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};

int cell_count(Interval interval, float cell_m) {
  return std::clamp(static_cast<int>(std::min(std::ceil(interval.span() / cell_m),
                                              static_cast<float>(kMostCellsOfEdge))),
                    1, kMostCellsOfEdge);
}

int cell_index(float offset_m, float cell_m, int count) {
  const float index = std::floor(offset_m / cell_m);
  return static_cast<int>(std::clamp(index, -1.0F, static_cast<float>(count)));
}

float median_around(const HeightField& field, int column, int row) {
  std::array<float, (2 * kGroundReach + 1) * (2 * kGroundReach + 1)> heights{};
  std::size_t count = 0;
  for (int dr = -kGroundReach; dr <= kGroundReach; ++dr) {
    for (int dc = -kGroundReach; dc <= kGroundReach; ++dc) {
      const float height = field.height_at(column + dc, row + dr);
      if (height > HeightField::kNone) heights[count++] = height;
    }
  }
  if (count == 0) return HeightField::kNone;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(heights.begin(), middle, heights.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

/// Share of the sky that neighbours hide, 0 none.
float occlusion(const HeightField& field, CellStep at, float height_m, float step_m) {
  float sum = 0.0F;
  for (const int reach : {1, 2, 4, 8}) {
    for (const CellStep& way : kAround) {
      const float neighbour =
          field.height_at(at.column + reach * way.column, at.row + reach * way.row);
      if (neighbour == HeightField::kNone) continue;
      const float rise_m = neighbour - height_m - step_m;
      const float distance_m = static_cast<float>(reach) * field.cell_m;
      if (rise_m > 0.0F) sum += std::min(rise_m / distance_m, 2.0F) / 2.0F;
    }
  }
  return sum / 32.0F;
}

/// The slope towards the light, [-1, 1], over three cells.
float slope_to_light(const HeightField& field, CellStep at, float height_m, CellStep light,
                     float step_m) {
  float sum = 0.0F;
  for (int reach = 1; reach <= 3; ++reach) {
    const float before =
        field.height_at(at.column + reach * light.column, at.row + reach * light.row);
    const float behind =
        field.height_at(at.column - reach * light.column, at.row - reach * light.row);
    const float low = before == HeightField::kNone ? height_m : before;
    const float high = behind == HeightField::kNone ? height_m : behind;
    const float rise_m = high - low;
    const float relief_m = std::max(std::abs(rise_m) - 2.0F * step_m, 0.0F);
    sum += std::copysign(relief_m, rise_m) / (2.0F * static_cast<float>(reach) * field.cell_m);
  }
  return std::clamp(sum / 3.0F, -1.0F, 1.0F);
}

}  // namespace

HeightField::HeightField(Interval x_m, Interval y_m, float cell)
    : x_low_m(x_m.low),
      y_low_m(y_m.low),
      cell_m(cell),
      columns(cell_count(x_m, cell)),
      rows(cell_count(y_m, cell)),
      height_m(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), kNone),
      color(height_m.size()) {}

int HeightField::column_of(float x) const { return cell_index(x - x_low_m, cell_m, columns); }

int HeightField::row_of(float y) const { return cell_index(y - y_low_m, cell_m, rows); }

void HeightField::raise(const RenderVoxel& voxel) {
  const int column = column_of(voxel.x);
  const int row = row_of(voxel.y);
  if (!contains(column, row)) return;
  const std::size_t cell = index(column, row);
  if (voxel.z <= height_m[cell]) return;
  height_m[cell] = voxel.z;
  color[cell] = voxel.color;
}

bool in_shadow(const HeightField& field, CellStep cell, float height_m, CellStep to_light,
               float slack_m) {
  constexpr float kReach_m = 6.0F;
  constexpr float kTangent = 0.84F;  // elevation of the sun: 40 degrees
  constexpr int kMaxSteps = 64;
  const bool diagonal = to_light.column != 0 && to_light.row != 0;
  const float stride_m = field.cell_m * (diagonal ? std::numbers::sqrt2_v<float> : 1.0F);
  const int steps = static_cast<int>(std::min(kReach_m / stride_m, static_cast<float>(kMaxSteps)));
  for (int i = 1; i <= steps; ++i) {
    const float neighbour =
        field.height_at(cell.column + i * to_light.column, cell.row + i * to_light.row);
    if (neighbour > height_m + slack_m + kTangent * stride_m * static_cast<float>(i)) return true;
  }
  return false;
}

HeightField ground_heights(const Scene& scene, Interval x_m, Interval y_m) {
  const float cell_m = std::max(kGroundCell_m, 4.0F * scene.resolution_m);
  HeightField lowest(x_m, y_m, cell_m);
  for (const RenderVoxel& voxel : scene.voxels) {
    if (!is_drawable(voxel)) continue;
    const int column = lowest.column_of(voxel.x);
    const int row = lowest.row_of(voxel.y);
    if (!lowest.contains(column, row)) continue;
    float& height = lowest.height_m[lowest.index(column, row)];
    if (height == HeightField::kNone || voxel.z < height) height = voxel.z;
  }
  HeightField ground(x_m, y_m, cell_m);
  for (int row = 0; row < ground.rows; ++row) {
    for (int column = 0; column < ground.columns; ++column) {
      ground.height_m[ground.index(column, row)] = median_around(lowest, column, row);
    }
  }
  return ground;
}

void shade_relief(HeightField& field, float step_m, bool turned) {
  const CellStep light = turned ? CellStep{-1, -1} : CellStep{-1, 1};
  for (int row = 0; row < field.rows; ++row) {
    for (int column = 0; column < field.columns; ++column) {
      const std::size_t cell = field.index(column, row);
      const float height_m = field.height_m[cell];
      if (height_m == HeightField::kNone) continue;
      const CellStep at{column, row};
      float factor = 1.0F - 0.55F * std::min(2.0F * occlusion(field, at, height_m, step_m), 1.0F);
      const float slope = slope_to_light(field, at, height_m, light, step_m);
      factor *= slope > 0.0F ? 1.0F + 0.25F * slope : 1.0F + 0.35F * slope;
      if (in_shadow(field, at, height_m, light, step_m)) factor *= 0.68F;
      field.color[cell] = scaled(field.color[cell], factor);
    }
  }
}

}  // namespace tessera
