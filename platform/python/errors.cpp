// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "errors.hpp"

#include <exception>

namespace tessera::python {

namespace {

PyObject* new_exception(py::module_& module, const char* name, const char* text,
                        const py::tuple& bases) {
  const std::string whole = std::string("tessera.") + name;
  PyObject* const type = PyErr_NewExceptionWithDoc(whole.c_str(), text, bases.ptr(), nullptr);
  if (type == nullptr) throw py::error_already_set();
  module.add_object(name, py::reinterpret_steal<py::object>(type));
  return type;
}

// Both live as long as the interpreter.
PyObject* error_type = nullptr;
PyObject* input_error_type = nullptr;

}  // namespace

void add_errors(py::module_& module) {
  error_type = new_exception(
      module, "Error",
      "The work could not be completed: the system, or the current state, refuses it.",
      py::make_tuple(py::handle(PyExc_RuntimeError)));
  input_error_type =
      new_exception(module, "InputError",
                    "An argument or a file is invalid; the message says what to give instead.",
                    py::make_tuple(py::handle(error_type), py::handle(PyExc_ValueError)));
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      PyErr_SetString(input_error_type, error.what());
    } catch (const WorkError& error) {
      PyErr_SetString(error_type, error.what());
    }
  });
}

void raise(const Failure& failure) {
  const std::string message = failure.text(Speaker::kPython);
  if (failure.kind == FailureKind::kUsage) throw InputError(message);
  throw WorkError(message);
}

void raise_type(const std::string& message) { throw py::type_error(message); }

}  // namespace tessera::python
