// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <fmt/core.h>

#include <string>

#include "held_map.hpp"

namespace tessera::python {

namespace {

py::dict all_counters(const IntegrationReport& report) {
  py::dict counters = counters_of(report.scan);
  counters["unknown_ids"] = report.unknown.points;
  return counters;
}

}  // namespace

void add_scan_report(py::module_& module) {
  py::class_<IntegrationReport> type(
      module, "ScanReport",
      "What integrating a scan did, and what it left out: a counter for each reason.");
  for (const Counter<ScanReport>& c : kCounters<ScanReport>) {
    type.def_property_readonly(
        c.name, [value = c.value](const IntegrationReport& r) { return value(r.scan); },
        c.sentence);
  }
  type.def_property_readonly(
          "unknown_ids", [](const IntegrationReport& r) { return r.unknown.points; },
          "Points whose raw id is in no class; taken as unlabelled.")
      .def_property_readonly(
          "unknown_id_examples",
          [](const IntegrationReport& r) {
            py::list ids;
            for (std::size_t i = 0; i < r.unknown.num_examples; ++i)
              ids.append(r.unknown.examples[i]);
            return ids;
          },
          "Up to 8 of these ids.")
      .def("as_dict", &all_counters, "All counters by name.")
      .def("__repr__", [](const IntegrationReport& r) {
        return fmt::format("<tessera.ScanReport: {} points, {} admitted, {} left out>",
                           r.scan.points, r.scan.admitted, r.scan.left_out());
      });
}

py::dict correction_of(const CorrectionReport& report) {
  if (report.status == Status::kUnsupported)
    throw InputError("the map is not in submaps; make it with submap_m");
  if (report.status != Status::kOk) {
    throw InputError(
        "the correction is refused: stamps must ascend, each pose be rigid and within 524 km, and "
        "revision be above " +
        std::to_string(report.revision));
  }
  py::dict d;
  d["moved"] = report.moved;
  d["most_m"] = report.most_m;
  d["residual_m"] = report.residual_m;
  d["revision"] = report.revision;
  return d;
}

}  // namespace tessera::python
