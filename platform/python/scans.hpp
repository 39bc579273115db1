// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Recorded scans, for Python.
#pragma once

#include "errors.hpp"

namespace tessera::python {

void add_scans(py::module_& module);

}  // namespace tessera::python
