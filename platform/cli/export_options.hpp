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
  [[nodiscard]] bool has_colors() const { return format != "csv" && !is_octree(); }
  [[nodiscard]] bool is_limited() const {
    return min_evidence > 0.0 || min_probability > 0.0 || max_variance < 0.25;
  }
  /// True if a voxel is written, in any format without a tree.
  [[nodiscard]] bool is_exported(const Estimate& estimate) const {
    if (estimate.evidence < min_evidence) return false;
    if (estimate.label != 0 && estimate.probability < min_probability) return false;
    if (is_uncertain(estimate, max_variance)) return false;
    return estimate.state == VoxelState::kOccupied ||
           (estimate.state == VoxelState::kFree &&
            (voxels == "observed" || layer.shows_as_moved(estimate.label)));
  }
};

void declare_export_options(CLI::App& command, ExportOptions& options);

/// Takes the format from the name of the file, if it is not given and the name has one.
void choose_format(ExportOptions& options);

/// Fails with kUsage iff there is no format, the name of the file ends as another one, a value is
/// not allowed, options exclude each other, or an output cannot be written (check_outputs).
Outcome<void> check_export(const ExportOptions& options);

/// The line above a picture; options: with the layer that is shown.
std::string title_of(const ExportOptions& options);

/// The values of all options.
Json to_json(const ExportOptions& options);

}  // namespace tessera
