// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How maps become one, in words of Python.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "errors.hpp"
#include "mapping/diffusion_options.hpp"
#include "mapping/report.hpp"

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
/// Raises InputError iff a name is none; ranges are checked by diffusion_of.
[[nodiscard]] DiffusionOptions options_of(const DiffusionArguments& given);

/// As Python has it.
[[nodiscard]] py::object dict_of(const Json& json);
/// A UserWarning each.
void warn_of(const std::vector<std::string>& warnings);

void add_fusing(py::module_& module);

}  // namespace tessera::python
