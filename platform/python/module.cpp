// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The module tessera._tessera; the package tessera exports its names.
#include "aligning.hpp"
#include "class_table.hpp"
#include "errors.hpp"
#include "evaluation.hpp"
#include "fusing.hpp"
#include "held_map.hpp"
#include "held_sharer.hpp"
#include "report.hpp"
#include "scans.hpp"
#include "tessera/base/version.hpp"

PYBIND11_MODULE(_tessera, module) {
  using namespace tessera::python;
  module.doc() = "Dense semantic occupancy maps that teams of robots build and share.";
  module.attr("__version__") = tessera::kVersion;
  add_errors(module);
  add_class_table(module);
  add_scan_report(module);
  add_map(module);
  add_local_map(module);
  add_fusing(module);
  add_aligning(module);
  add_sharer(module);
  add_evaluation(module);
  add_scans(module);
}
