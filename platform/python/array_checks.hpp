// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is asked of every array, and how one that does not fit is refused.
#pragma once

#include <fmt/core.h>
#include <pybind11/numpy.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "errors.hpp"

namespace tessera::python {

inline std::string shape_of(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i)
    text += fmt::format("{}{}", (i == 0 ? "" : ", "), array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

inline std::string type_of(const py::array& array) { return py::str(array.dtype()); }

template <class T>
[[nodiscard]] bool is_of(const py::array& array) {
  return py::isinstance<py::array_t<T>>(array);
}

inline bool is_aligned(const py::array& array, std::size_t bytes) {
  return reinterpret_cast<std::uintptr_t>(array.data()) % bytes == 0;
}

[[noreturn]] inline void refuse_shape(const py::array& array, const std::string& name,
                                      const std::string& wanted) {
  throw InputError(name + " has the shape " + shape_of(array) + "; give " + wanted);
}

}  // namespace tessera::python
