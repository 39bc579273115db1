// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options of "export", and which of them go together.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "cli/export_layers.hpp"
#include "mapping/report.hpp"
#include "posix/outcome.hpp"
#include "render/picture.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

struct ExportOptions {
  std::string map;
  std::string format;
  std::string out;
  std::string report;
  std::string view = "both";
  std::string ply_form = "points";
  std::string voxels = "occupied";
  std::string title;
  int width_px = ImageOptions{}.width_px;
  double min_evidence = 0.0;
  double min_probability = 0.0;
  double max_variance = 0.25;  ///< No label can have more.
  LayerOptions layer;

  /// A row for each voxel: pcd, npy or csv.
  [[nodiscard]] bool is_table() const {
    return format == "pcd" || format == "npy" || format == "csv";
  }
  [[nodiscard]] bool is_octree() const { return format == "bt" || format == "ot"; }
  [[nodiscard]] bool is_limited() const {
    return min_evidence > 0.0 || min_probability > 0.0 || max_variance < 0.25;
  }
  /// Whether a voxel is exported, its state aside.
  [[nodiscard]] bool passes_limits(const Estimate& estimate) const {
    if (estimate.evidence < min_evidence) return false;
    if (estimate.label != 0 && estimate.probability < min_probability) return false;
    return !is_uncertain(estimate, max_variance);
  }
};

void declare_export_options(CLI::App& command, ExportOptions& options);

/// Fails with kUsage iff a value is not allowed, options do not go together, or an output has no
/// place (check_outputs).
Outcome<void> check_export(const ExportOptions& options);

/// The line above a picture.
std::string title_of(const ExportOptions& options);

/// Every option's value.
Json to_json(const ExportOptions& options);

}  // namespace tessera
