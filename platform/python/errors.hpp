// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Turns failures into exceptions of Python: the only place of the project that throws.
#pragma once

#include <pybind11/pybind11.h>

#include <stdexcept>
#include <string>

#include "base/outcome.hpp"

namespace tessera::python {

namespace py = pybind11;

/// tessera.InputError: an argument or a file is invalid.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// tessera.Error: the work could not be completed.
class WorkError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Adds both to the module.
void add_errors(py::module_& module);

[[noreturn]] void raise(const Failure& failure);
/// TypeError.
[[noreturn]] void raise_type(const std::string& message);

inline void check(const Outcome<void>& outcome) {
  if (!outcome.ok()) raise(outcome.failure());
}
template <class T>
[[nodiscard]] T value_of(Outcome<T>&& outcome) {
  if (!outcome.ok()) raise(outcome.failure());
  return std::move(*outcome);
}

}  // namespace tessera::python
