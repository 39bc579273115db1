// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Arrays of numpy as input of the library, without copies: a view or a refusal.
#pragma once

#include <pybind11/numpy.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "errors.hpp"
#include "tessera/base/geometry.hpp"
#include "tessera/registration/points_view.hpp"

namespace tessera::python {

/// (N, 3) or wider, float32, x y z first, metres. Rows may be any number of floats apart, so that
/// array[:, :3] and array[::2] need no copies. Raises TypeError iff it is not float32, InputError
/// iff the shape is another, or x y z are not next to each other or not aligned.
[[nodiscard]] PointsView points_of(const py::array& array, const char* name);

/// (N,), float32, without gaps. Raises as points_of, and iff N is not count.
[[nodiscard]] const float* weights_of(const py::array& array, std::size_t count);

/// (N,), bool or uint8, without gaps; not 0: true. Raises as weights_of.
[[nodiscard]] const std::uint8_t* flags_of(const py::array& array, const char* name,
                                           std::size_t count);

/// Converts anything that is not an array of doubles.
using StampArray = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
using PoseArray = py::array_t<double, py::array::c_style | py::array::forcecast>;
/// (4, 4) or (3, 4); the identity if not given. Raises InputError iff the shape is another, or it
/// is not a rigid transform.
[[nodiscard]] Matrix34d pose_of(const std::optional<PoseArray>& array, const char* name);

/// Stamps, and twelve numbers of each pose, rows first.
struct StampedPoses {
  std::vector<std::int64_t> stamps_us;
  std::vector<double> transforms;
};
/// poses: (N, 4, 4) or (N, 3, 4). Raises InputError iff the shapes are others, or differ in N.
[[nodiscard]] StampedPoses stamped_poses_of(const StampArray& stamps_us, const PoseArray& poses);
/// (4, 4).
[[nodiscard]] py::array_t<double> array_of(const Matrix34d& T);

/// Coordinates of float32 or float64, in any layout. The array must outlive it.
class Coordinates {
 public:
  /// (N, 3) or wider, or (3,) for one. Raises as points_of.
  Coordinates(const py::array& array, const char* name);
  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] Point3d operator[](std::size_t i) const noexcept;

 private:
  const char* data_ = nullptr;
  std::ptrdiff_t row_bytes_ = 0;
  std::ptrdiff_t column_bytes_ = 0;
  std::size_t count_ = 0;
  bool is_double_ = false;
};

/// An array over the memory of owner, which it keeps alive. columns: 0 for one dimension.
template <class T>
[[nodiscard]] py::array_t<T> array_over(std::span<const T> values, std::size_t columns,
                                        const py::capsule& owner) {
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(values.size())};
  if (columns != 0)
    shape = {static_cast<py::ssize_t>(values.size() / columns), static_cast<py::ssize_t>(columns)};
  return py::array_t<T>(shape, values.data(), owner);
}
/// An array that has taken the vector's memory.
template <class T>
[[nodiscard]] py::array_t<T> array_taking(std::vector<T>&& values, std::size_t columns = 0) {
  auto* const kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept,
                          [](void* pointer) { delete static_cast<std::vector<T>*>(pointer); });
  return array_over(std::span<const T>(*kept), columns, owner);
}
/// New arrays, whose content is not yet written.
template <class T>
[[nodiscard]] py::array_t<T> new_array(std::size_t count) {
  return py::array_t<T>(static_cast<py::ssize_t>(count));
}
template <class T>
[[nodiscard]] py::array_t<T> new_array(std::size_t count, std::size_t columns) {
  return py::array_t<T>({count, columns});
}

}  // namespace tessera::python
