// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Arguments for fusing maps in Python.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "errors.hpp"
#include "settings/diffusion_options.hpp"

namespace tessera::python {

struct DiffusionArguments {
  std::string diffusion;
  std::string edge;
  std::optional<int> iterations;
  std::optional<double> diffusion_length_m;
  double alpha;
  double omega;
  bool whole_map;
};
/// Raises InputError iff a name is unknown; diffusion_of checks ranges.
[[nodiscard]] DiffusionOptions options_of(const DiffusionArguments& given);

/// As a Python object.
[[nodiscard]] py::object dict_of(const Json& json);
/// Issues a UserWarning for each.
void warn_of(const std::vector<std::string>& warnings);

void add_fusing(py::module_& module);

}  // namespace tessera::python
