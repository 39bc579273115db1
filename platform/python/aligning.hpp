// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera.align: the transform between two maps.
#pragma once

#include "errors.hpp"

namespace tessera::python {

void add_aligning(py::module_& module);

}  // namespace tessera::python
