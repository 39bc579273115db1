// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Turns failures into exceptions of Python: the only place of the project that throws.
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <limits>
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

/// A whole number for an argument that is no setting. Raises InputError iff it is out of its range.
template <class T>
[[nodiscard]] T in_range(std::int64_t given, const char* name, T least, T most) {
  if (given >= static_cast<std::int64_t>(least) && given <= static_cast<std::int64_t>(most))
    return static_cast<T>(given);
  throw InputError(std::string(name) + " " + std::to_string(given) + " is not allowed; give " +
                   std::to_string(least) + " to " + std::to_string(most));
}
/// Of all values of the type that are not negative.
template <class T>
[[nodiscard]] T in_range(std::int64_t given, const char* name) {
  return in_range<T>(given, name, 0, std::numeric_limits<T>::max());
}

inline void check(const Outcome<void>& outcome) {
  if (!outcome.ok()) raise(outcome.failure());
}
template <class T>
[[nodiscard]] T value_of(Outcome<T>&& outcome) {
  if (!outcome.ok()) raise(outcome.failure());
  return std::move(*outcome);
}

}  // namespace tessera::python
