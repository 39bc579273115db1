// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Fusing maps in Python, and reports as dictionaries.
#pragma once

#include <string>
#include <vector>

#include "base/json.hpp"
#include "errors.hpp"

namespace tessera::python {

/// As a Python object.
[[nodiscard]] py::object dict_of(const Json& json);
/// Issues a UserWarning for each. frames: from here to the user's, 2 of functions and methods,
/// which _refusals.py wraps; 1 of properties.
void warn_of(const std::vector<Message>& warnings, int frames = 2);

void add_fusing(py::module_& module);

}  // namespace tessera::python
