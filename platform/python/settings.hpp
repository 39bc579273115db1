// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Keyword arguments that are settings: the rows of a table.
#pragma once

#include "errors.hpp"
#include "settings/setting.hpp"

namespace tessera::python {

namespace detail {
void take_settings(py::dict& given, std::span<const Setting> rows, void* options, bool fixed);
}

/// Sets the options that are given, and removes them from given. fixed: those for the life of a map
/// too. Raises InputError iff a value is not allowed, TypeError iff it is of another type.
template <class Options>
void take_settings(py::dict& given, const SettingTable<Options>& table,
                   std::type_identity_t<Options>& options, bool fixed = true) {
  detail::take_settings(given, table.rows, &options, fixed);
}

/// "resolution_m: float | None = None, ..." for a docstring.
[[nodiscard]] std::string arguments_text(std::span<const Setting> rows, const void* defaults,
                                         bool fixed = true);

/// Raises TypeError iff an argument is left that no table has. function: its name.
void refuse_others(const py::dict& given, const char* function);

}  // namespace tessera::python
