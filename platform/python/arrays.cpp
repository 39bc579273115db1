// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include <fmt/core.h>

#include <cstring>
#include <limits>
#include <string>

#include "array_checks.hpp"

namespace tessera::python {

namespace {

/// A wider array is not one of points, but probably transposed.
constexpr py::ssize_t kMostColumns = 32;
constexpr const char* kPointsShape = "(N, 3) or wider, up to 32: x y z first";

}  // namespace

PointsView points_of(const py::array& array, const char* name) {
  const std::string n(name);
  if (!is_of<float>(array))
    raise_type(n + " is of " + type_of(array) + "; give float32: " + n + ".astype(numpy.float32)");
  if (array.ndim() != 2 || array.shape(1) < 3 || array.shape(1) > kMostColumns)
    refuse_shape(array, n, kPointsShape);
  PointsView points;
  points.count = static_cast<std::size_t>(array.shape(0));
  if (points.count == 0) return points;
  // Counters of reports have 32 bits.
  if (points.count > std::numeric_limits<std::uint32_t>::max())
    throw InputError(n + " has the shape " + shape_of(array) + "; give at most 2^32 - 1 points");
  constexpr auto kFloat = static_cast<py::ssize_t>(sizeof(float));
  // From row to row; a single row has no next one.
  const py::ssize_t step = points.count == 1 ? 3 * kFloat : array.strides(0);
  const bool fits = array.strides(1) == kFloat && step >= 0 && step % kFloat == 0 &&
                    is_aligned(array, alignof(float));
  if (!fits) {
    throw InputError(n +
                     " does not have x y z next to each other in ascending rows; give "
                     "numpy.ascontiguousarray(" +
                     n + ")");
  }
  points.points = static_cast<const float*>(array.data());
  points.stride_floats = static_cast<std::size_t>(step / kFloat);
  return points;
}

const float* weights_of(const py::array& array, std::size_t count) {
  if (!is_of<float>(array))
    raise_type("weights is of " + type_of(array) + "; give float32: weights.astype(numpy.float32)");
  if (array.ndim() != 1 || static_cast<std::size_t>(array.shape(0)) != count)
    refuse_shape(array, "weights", fmt::format("one for each of the {} points", count));
  if (count == 0) return nullptr;
  const bool fits = (count == 1 || array.strides(0) == static_cast<py::ssize_t>(sizeof(float))) &&
                    is_aligned(array, alignof(float));
  if (!fits) throw InputError("weights has gaps; give numpy.ascontiguousarray(weights)");
  return static_cast<const float*>(array.data());
}

const std::uint8_t* flags_of(const py::array& array, const char* name, std::size_t count) {
  const std::string n(name);
  if (!is_of<bool>(array) && !is_of<std::uint8_t>(array))
    raise_type(n + " is of " + type_of(array) + "; give bool: " + n + ".astype(bool)");
  if (array.ndim() != 1 || static_cast<std::size_t>(array.shape(0)) != count)
    refuse_shape(array, name, fmt::format("one for each of the {} points", count));
  if (count > 1 && array.strides(0) != 1)
    throw InputError(n + " has gaps; give numpy.ascontiguousarray(" + n + ")");
  return count == 0 ? nullptr : static_cast<const std::uint8_t*>(array.data());
}

Matrix34d pose_of(const std::optional<PoseArray>& array, const char* name) {
  Matrix34d T = Matrix34d::Identity();
  if (!array) return T;
  const bool is_square = array->ndim() == 2 && array->shape(0) == 4 && array->shape(1) == 4;
  const bool has_rows = array->ndim() == 2 && array->shape(0) == 3 && array->shape(1) == 4;
  if (!is_square && !has_rows) refuse_shape(*array, name, "(4, 4) or (3, 4): [R | t], metres");
  const auto at = array->unchecked<2>();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) T(row, column) = at(row, column);
  }
  const bool ends_well =
      !is_square || (at(3, 0) == 0.0 && at(3, 1) == 0.0 && at(3, 2) == 0.0 && at(3, 3) == 1.0);
  if (!ends_well || check_rigid(T) != Status::kOk) {
    throw InputError(std::string(name) +
                     " is not a rigid transform: give [R | t] with R a rotation, all finite");
  }
  return T;
}

StampedPoses stamped_poses_of(const StampArray& stamps_us, const PoseArray& poses) {
  if (stamps_us.ndim() != 1) refuse_shape(stamps_us, "stamps_us", "(N,): microseconds");
  const py::ssize_t count = stamps_us.shape(0);
  const bool fits = poses.ndim() == 3 && poses.shape(0) == count &&
                    (poses.shape(1) == 3 || poses.shape(1) == 4) && poses.shape(2) == 4;
  if (!fits)
    refuse_shape(poses, "T_world_sensor", "(N, 4, 4) or (N, 3, 4), as many as stamps: [R | t]");
  StampedPoses result;
  const auto stamps = stamps_us.unchecked<1>();
  const auto at = poses.unchecked<3>();
  for (py::ssize_t i = 0; i < count; ++i) {
    result.stamps_us.push_back(stamps(i));
    for (py::ssize_t k = 0; k < 12; ++k) result.transforms.push_back(at(i, k / 4, k % 4));
  }
  return result;
}

py::array_t<double> array_of(const Matrix34d& T) {
  py::array_t<double> array({4, 4});
  auto at = array.mutable_unchecked<2>();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column)
      at(row, column) = row < 3 ? T(row, column) : (column == 3 ? 1.0 : 0.0);
  }
  return array;
}

Coordinates::Coordinates(const py::array& array, const char* name) {
  is_double_ = is_of<double>(array);
  if (!is_double_ && !is_of<float>(array))
    raise_type(std::string(name) + " is of " + type_of(array) + "; give float32 or float64");
  const bool is_one = array.ndim() == 1 && array.shape(0) == 3;
  const bool are_many = array.ndim() == 2 && array.shape(1) >= 3 && array.shape(1) <= kMostColumns;
  if (!is_one && !are_many)
    refuse_shape(array, name, std::string(kPointsShape) + "; or (3,) for one");
  data_ = static_cast<const char*>(array.data());
  count_ = is_one ? 1 : static_cast<std::size_t>(array.shape(0));
  row_bytes_ = is_one ? 0 : array.strides(0);
  column_bytes_ = array.strides(is_one ? 0 : 1);
}

Point3d Coordinates::operator[](std::size_t i) const noexcept {
  const char* const row = data_ + static_cast<std::ptrdiff_t>(i) * row_bytes_;
  Point3d p;
  for (int axis = 0; axis < 3; ++axis) {
    const char* const from = row + axis * column_bytes_;
    double value = 0.0;
    float single = 0.0F;
    if (is_double_) {
      std::memcpy(&value, from, sizeof(value));
    } else {
      std::memcpy(&single, from, sizeof(single));
      value = static_cast<double>(single);
    }
    p[axis] = value;
  }
  return p;
}

}  // namespace tessera::python
