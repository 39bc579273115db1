// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The report of a scan, for Python.
#pragma once

#include "errors.hpp"
#include "tessera/base/counters.hpp"

namespace tessera::python {

/// All numbers of a report by their names.
template <class Report>
py::dict counters_of(const Report& report) {
  py::dict counters;
  for (const Counter<Report>& row : kCounters<Report>) counters[row.name] = row.value(report);
  return counters;
}

void add_scan_report(py::module_& module);

}  // namespace tessera::python
