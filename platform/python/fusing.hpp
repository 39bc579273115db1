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
/// Issues a UserWarning for each.
void warn_of(const std::vector<Message>& warnings);

void add_fusing(py::module_& module);

}  // namespace tessera::python
