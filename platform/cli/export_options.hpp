// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options of "export", and which of them may be combined.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "base/json.hpp"
#include "base/outcome.hpp"
#include "cli/export_layers.hpp"
#include "pictures/picture.hpp"
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
  double max_variance = 0.25;  ///< The largest variance that a label can have.
  LayerOptions layer;

  /// A row for each voxel: pcd, npy or csv.
  [[nodiscard]] bool is_table() const {
    return format == "pcd" || format == "npy" || format == "csv";
  }
  [[nodiscard]] bool is_octree() const { return format == "bt" || format == "ot"; }
  [[nodiscard]] bool is_limited() const {
    return min_evidence > 0.0 || min_probability > 0.0 || max_variance < 0.25;
  }
  /// True if a voxel is exported, apart from its state.
  [[nodiscard]] bool passes_limits(const Estimate& estimate) const {
    if (estimate.evidence < min_evidence) return false;
    if (estimate.label != 0 && estimate.probability < min_probability) return false;
    return !is_uncertain(estimate, max_variance);
  }
};

void declare_export_options(CLI::App& command, ExportOptions& options);

/// Fails with kUsage iff a value is not allowed, options exclude each other, or an output cannot be
/// written (check_outputs).
Outcome<void> check_export(const ExportOptions& options);

/// The line above a picture.
std::string title_of(const ExportOptions& options);

/// The values of all options.
Json to_json(const ExportOptions& options);

}  // namespace tessera
