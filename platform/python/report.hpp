// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report of a scan, for Python.
#pragma once

#include "errors.hpp"

namespace tessera::python {

void add_scan_report(py::module_& module);

}  // namespace tessera::python
