// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How what goes wrong comes to Python: this border is the only place of the project where it is
// thrown.
#pragma once

#include <pybind11/pybind11.h>

#include <stdexcept>
#include <string>

#include "posix/outcome.hpp"

namespace tessera::python {

namespace py = pybind11;

/// tessera.InputError: an argument or a file is not what it has to be.
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

/// The failure's sentence, with the names that the arguments have in Python: resolution_m where it
/// has --resolution.
[[nodiscard]] std::string in_words_of_python(const std::string& message);

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
