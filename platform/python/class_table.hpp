// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Classes as Python gives them: a map's table, and which raw ids of labels stand for them.
#pragma once

#include <memory>

#include "dataset/dataset_classes.hpp"
#include "errors.hpp"

namespace tessera::python {

/// raw_ids: null where only the table is known, as of a map file.
struct Classes {
  ClassTable table;
  std::shared_ptr<const DatasetClasses> raw_ids;
};

[[nodiscard]] Classes classes_of(DatasetClasses&& classes);

void add_class_table(py::module_& module);

}  // namespace tessera::python
