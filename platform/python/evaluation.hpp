// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Evaluation of maps, for Python.
#pragma once

#include "errors.hpp"

namespace tessera::python {

void add_evaluation(py::module_& module);

}  // namespace tessera::python
