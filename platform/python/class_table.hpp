// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Classes of Python: the table of a map, and the raw ids of its labels.
#pragma once

#include <memory>

#include "errors.hpp"
#include "scans/dataset_classes.hpp"

namespace tessera::python {

/// raw_ids: null if only the table is known, as for a map file.
struct Classes {
  ClassTable table;
  std::shared_ptr<const DatasetClasses> raw_ids;
};

[[nodiscard]] Classes classes_of(DatasetClasses&& classes);

void add_class_table(py::module_& module);

}  // namespace tessera::python
