// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/replica/grid_transform.hpp"

#include <cmath>
#include <cstring>

#include "tessera/base/internal/lanes.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

using Row = std::array<double, 3>;

double dot(const Row& a, const Row& b) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
void scale_to_unit(Row& row) noexcept {
  const double length = std::sqrt(dot(row, row));
  for (double& x : row) x /= length;
}

/// Half of a turned block's extent on an axis, with what rounding needs.
double half_extent(double a, double b, double c, double half) noexcept {
  constexpr double kSlack = 1e-6;
  const double edge = (a < 0 ? -a : a) + (b < 0 ? -b : b) + (c < 0 ? -c : c);
  return half * edge + kSlack;
}

constexpr double kHalfBlock = kBlockEdge / 2.0;
/// No corner of a box, and no centre, is nearer to the faces of its voxel, so that frames that are
/// turned about one axis alone need no neighbours on it.
constexpr double kInset = 0.0009;

}  // namespace

Result<GridTransform> GridTransform::make(const Matrix34d& T_global_local,
                                          double resolution_m) noexcept {
  if (check_rigid(T_global_local) != Status::kOk || !(resolution_m > 0.0))
    return Status::kInvalidArgument;
  Row x{T_global_local(0, 0), T_global_local(0, 1), T_global_local(0, 2)};
  Row y{T_global_local(1, 0), T_global_local(1, 1), T_global_local(1, 2)};
  scale_to_unit(x);
  const double along = dot(x, y);
  for (std::size_t i = 0; i < 3; ++i) y[i] -= along * x[i];
  scale_to_unit(y);
  const Row z{x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]};
  GridTransform result;
  result.r_ = {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
  std::array<std::int32_t, 3> whole{};
  bool shift_only = result.r_ == std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (std::size_t i = 0; i < 3; ++i) {
    const double t = T_global_local(static_cast<Eigen::Index>(i), 3) / resolution_m;
    constexpr double kFarthest = kBlockLimit;
    if (!(t >= -kFarthest && t <= kFarthest)) return Status::kInvalidArgument;
    result.t_[i] = t;
    whole[i] = floor_to_int(t + 0.5);
    // Decimal metres by decimal metres are seldom whole to the last bit.
    const double off = t - whole[i];
    shift_only = shift_only && off < 1e-9 && off > -1e-9;
  }
  result.shift_only_ = shift_only;
  if (shift_only) {
    result.shift_ = {whole[0], whole[1], whole[2]};
    for (std::size_t i = 0; i < 3; ++i) result.t_[i] = whole[i];
  }
  return result;
}

/// In voxels, so that nothing is scaled to metres and back.
Result<GridTransform> GridTransform::compose(const Matrix34d& T_team_world,
                                             const GridTransform& T_world_local,
                                             double resolution_m) noexcept {
  if (T_team_world == Matrix34d::Identity()) return T_world_local;
  if (!(resolution_m > 0.0)) return Status::kInvalidArgument;
  Matrix34d team = T_team_world;
  for (int row = 0; row < 3; ++row) team(row, 3) /= resolution_m;
  return make(product(team, T_world_local.in_voxels()), 1.0);
}

Matrix34d GridTransform::in_voxels() const noexcept {
  Matrix34d T;
  for (int row = 0; row < 3; ++row) {
    const auto at = static_cast<std::size_t>(row);
    for (int column = 0; column < 3; ++column)
      T(row, column) = r_[3 * at + static_cast<std::size_t>(column)];
    T(row, 3) = t_[at];
  }
  return T;
}

Matrix34d GridTransform::in_metres(double resolution_m) const noexcept {
  Matrix34d T = in_voxels();
  for (int row = 0; row < 3; ++row) T(row, 3) *= resolution_m;
  return T;
}

namespace {

/// floor_to_int of both.
void floor_two(const Double2& value, std::int32_t* to) noexcept {
  using Int2 = std::int32_t __attribute__((vector_size(8)));
  const Int2 truncated = __builtin_convertvector(value, Int2);
  const Long2 is_above = __builtin_convertvector(truncated, Double2) > value;
  const Int2 floor = truncated + __builtin_convertvector(is_above, Int2);
  std::memcpy(to, &floor, sizeof(floor));
}

}  // namespace

/// As to_local() of each, in the same order of sums, and what voxels share is computed once.
void GridTransform::to_local(BlockCoord global, std::span<VoxelCoord> rows) const noexcept {
  constexpr auto kEdge = static_cast<std::size_t>(kBlockEdge);
  const VoxelCoord corner = voxel_at(global, 0, 0);
  for (std::size_t z = 0; z < kEdge; ++z) {
    const double to_z = corner.z + static_cast<std::int32_t>(z) + 0.5 - t_[2];
    std::array<std::array<std::int32_t, kEdge * kEdge>, 3> local;  // NOLINT: all of it is written
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<Double2, kEdge / 2> of_x;  // NOLINT: all of it is written
      for (std::size_t i = 0; i < of_x.size(); ++i) {
        const std::int32_t x = corner.x + static_cast<std::int32_t>(2 * i);
        of_x[i] = Double2{r_[axis] * (x + 0.5 - t_[0]), r_[axis] * (x + 1 + 0.5 - t_[0])};
      }
      const double of_z = r_[6 + axis] * to_z;
      std::int32_t* to = local[axis].data();
      for (std::int32_t y = 0; y < kBlockEdge; ++y) {
        const double of_y = r_[3 + axis] * (corner.y + y + 0.5 - t_[1]);
        for (const Double2& two : of_x) {
          floor_two((two + Double2{of_y, of_y}) + Double2{of_z, of_z}, to);
          to += 2;
        }
      }
    }
    for (std::size_t i = 0; i < kEdge * kEdge; ++i)
      rows[kEdge * kEdge * z + i] = {local[0][i], local[1][i], local[2][i]};
  }
}

GridTransform::BoxCorners GridTransform::box_corners(VoxelCoord local,
                                                     Centroid centroid) const noexcept {
  using Ends = std::array<double, 2>;
  const std::array<int, 3> levels = centroid.levels();
  const auto ends_of = [](std::int32_t voxel, int level) {
    constexpr float kFace = 0.001F;
    const float middle = Centroid::middle_of(level);
    const float low = middle - kHalfBox;
    const float high = middle + kHalfBox;
    return Ends{voxel + static_cast<double>(low < kFace ? kFace : low),
                voxel + static_cast<double>(high > 1.0F - kFace ? 1.0F - kFace : high)};
  };
  const Ends x = ends_of(local.x, levels[0]);
  const Ends y = ends_of(local.y, levels[1]);
  const Ends z = ends_of(local.z, levels[2]);
  std::array<std::array<std::int32_t, kBoxCorners>, 3> corners;  // NOLINT: all of it is written
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* const r = &r_[3 * axis];
    const Double2 of_x = Double2{r[0], r[0]} * Double2{x[0], x[1]};
    const Double2 t{t_[axis], t_[axis]};
    for (std::size_t k = 0; k < 2; ++k) {
      const double of_z = r[2] * z[k];
      for (std::size_t j = 0; j < 2; ++j) {
        const double of_y = r[1] * y[j];
        floor_two(((of_x + Double2{of_y, of_y}) + Double2{of_z, of_z}) + t,
                  &corners[axis][4 * k + 2 * j]);
      }
    }
  }
  BoxCorners result;
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = {corners[0][i], corners[1][i], corners[2][i]};
  return result;
}

GridTransform::VoxelBox GridTransform::around(const std::array<double, 3>& center,
                                              const std::array<double, 3>& half) noexcept {
  std::array<std::int32_t, 3> first{};
  std::array<std::int32_t, 3> last{};
  for (std::size_t i = 0; i < 3; ++i) {
    first[i] = floor_to_int(center[i] - half[i]);
    last[i] = floor_to_int(center[i] + half[i]);
  }
  return {{first[0], first[1], first[2]}, {last[0], last[1], last[2]}};
}

GridTransform::VoxelBox GridTransform::local_box(BlockCoord global) const noexcept {
  const VoxelCoord corner = voxel_at(global, 0, 0);
  if (shift_only_) {
    const VoxelCoord first = corner - shift_;
    return {first, {first.x + 7, first.y + 7, first.z + 7}};
  }
  const double x = corner.x + kHalfBlock - t_[0];
  const double y = corner.y + kHalfBlock - t_[1];
  const double z = corner.z + kHalfBlock - t_[2];
  const auto half = [](double a, double b, double c) {
    return half_extent(a, b, c, kHalfBlock) - kInset;
  };
  return around({r_[0] * x + r_[3] * y + r_[6] * z, r_[1] * x + r_[4] * y + r_[7] * z,
                 r_[2] * x + r_[5] * y + r_[8] * z},
                {half(r_[0], r_[3], r_[6]), half(r_[1], r_[4], r_[7]), half(r_[2], r_[5], r_[8])});
}

GridTransform::VoxelBox GridTransform::global_box(BlockCoord local) const noexcept {
  const VoxelCoord corner = voxel_at(local, 0, 0);
  if (shift_only_) {
    const VoxelCoord first{corner.x + shift_.x, corner.y + shift_.y, corner.z + shift_.z};
    return {first, {first.x + 7, first.y + 7, first.z + 7}};
  }
  // The middle of the eight voxels: half a voxel before the centre of the fifth.
  const std::array<double, 3> five = to_global({corner.x + 4, corner.y + 4, corner.z + 4});
  std::array<double, 3> center{};
  std::array<double, 3> half{};
  for (std::size_t i = 0; i < 3; ++i) {
    center[i] = five[i] - 0.5 * (r_[3 * i] + r_[3 * i + 1] + r_[3 * i + 2]);
    half[i] = half_extent(r_[3 * i], r_[3 * i + 1], r_[3 * i + 2], kHalfBlock - kInset);
  }
  return around(center, half);
}

}  // namespace tessera
