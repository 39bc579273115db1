// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report of a scan, for Python.
#pragma once

#include "errors.hpp"
#include "tessera/base/counters.hpp"

namespace tessera::python {

/// Adds all numbers of a report by their names.
template <class Report>
void add_counters(py::dict& counters, const Report& report) {
  for (const Counter<Report>& row : kCounters<Report>)
    with_number(row, report, [&](auto number) { counters[row.name] = number; });
}

template <class Report>
py::dict counters_of(const Report& report) {
  py::dict counters;
  add_counters(counters, report);
  return counters;
}

void add_scan_report(py::module_& module);

/// A report of a correction. Raises InputError iff it was refused.
py::dict correction_of(const CorrectionReport& report);

}  // namespace tessera::python
