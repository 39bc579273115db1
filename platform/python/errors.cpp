// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "errors.hpp"

#include <array>
#include <cstdint>
#include <exception>
#include <string_view>
#include <utility>

namespace tessera::python {

namespace {

/// Options whose argument in Python has another name: most have a unit.
constexpr std::array<std::pair<std::string_view, std::string_view>, 11> kRenamed{{
    {"resolution", "resolution_m"},
    {"kernel-length", "kernel_length_m"},
    {"max-range", "max_range_m"},
    {"min-range", "min_range_m"},
    {"downsample", "downsample_m"},
    {"deadline", "deadline_ms"},
    {"window", "window_m"},
    {"memory", "memory_bytes"},
    {"fusion-memory", "fusion_memory_bytes"},
    {"diffusion-length", "diffusion_length_m"},
    {"transform", "transforms"},
}};

/// Remedies that differ in Python.
constexpr std::array<std::pair<std::string_view, std::string_view>, 2> kReworded{{
    {"bytes, or a number with K, M or G", "bytes, at most 10^15"},
    {", or off", ", or 0 for none"},
}};

/// Replaces "give at least 3M" by the number for Python.
void spell_out_mebibytes(std::string& words) {
  constexpr std::string_view kBefore = "give at least ";
  const std::size_t found = words.find(kBefore);
  if (found == std::string::npos) return;
  const std::size_t first = found + kBefore.size();
  const std::size_t end = words.find_first_not_of("0123456789", first);
  if (end == std::string::npos || end == first || words[end] != 'M') return;
  const std::uint64_t bytes = std::stoull(words.substr(first, end - first)) << 20U;
  words.replace(first, end + 1 - first, std::to_string(bytes) + " bytes");
}

std::string argument_of(std::string_view option) {
  for (const auto& [name, argument] : kRenamed) {
    if (option == name) return std::string(argument);
  }
  std::string argument(option);
  for (char& letter : argument) {
    if (letter == '-') letter = '_';
  }
  return argument;
}

bool is_of_option(char letter) { return (letter >= 'a' && letter <= 'z') || letter == '-'; }

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

std::string in_words_of_python(const std::string& message) {
  std::string words;
  std::size_t at = 0;
  // A quoted command keeps its options.
  const std::size_t command = message.find("tessera key ");
  while (at < message.size()) {
    const bool at_word = at < command && (at == 0 || message[at - 1] == ' ');
    if (!at_word || message.compare(at, 2, "--") != 0) {
      words += message[at++];
      continue;
    }
    std::size_t end = at + 2;
    while (end < message.size() && is_of_option(message[end])) ++end;
    words += argument_of(std::string_view(message).substr(at + 2, end - at - 2));
    at = end;
  }
  spell_out_mebibytes(words);
  for (const auto& [said, meant] : kReworded) {
    if (const std::size_t found = words.find(said); found != std::string::npos)
      words.replace(found, said.size(), meant);
  }
  return words;
}

void raise(const Failure& failure) {
  const std::string message = in_words_of_python(failure.message);
  if (failure.kind == FailureKind::kUsage) throw InputError(message);
  throw WorkError(message);
}

void raise_type(const std::string& message) { throw py::type_error(message); }

}  // namespace tessera::python
