// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/export_options.hpp"

#include <filesystem>

#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/number_options.hpp"
#include "maps/fuse_inputs.hpp"
#include "maps/octree_writer.hpp"

namespace tessera {

namespace {

Outcome<void> check_values(const ExportOptions& options) {
  if (options.format != "ply" && options.format != "png" && !options.is_table() &&
      !options.is_octree())
    return not_allowed("--format", options.format, "png, ply, pcd, npy, csv, bt or ot");
  if (options.view != "both" && options.view != "top" && options.view != "oblique")
    return not_allowed("--view", options.view, "both, top or oblique");
  if (options.ply_form != "points" && options.ply_form != "cubes")
    return not_allowed("--ply-form", options.ply_form, "points or cubes");
  if (options.width_px < ImageOptions::kMinWidthPx ||
      options.width_px > ImageOptions::kMaxWidthPx) {
    return not_allowed("--width", std::to_string(options.width_px),
                       std::to_string(ImageOptions::kMinWidthPx) + " to " +
                           std::to_string(ImageOptions::kMaxWidthPx) + " pixels");
  }
  if (!(options.min_evidence >= 0.0 && options.min_evidence <= 1e6))
    return not_allowed("--min-evidence", text_of(options.min_evidence), "a number from 0 to 1e6");
  if (!(options.min_probability >= 0.0 && options.min_probability <= 1.0))
    return not_allowed("--min-probability", text_of(options.min_probability),
                       "a number from 0 to 1");
  if (!(options.max_variance >= 0.0 && options.max_variance <= 0.25))
    return not_allowed("--max-variance", text_of(options.max_variance), "a number from 0 to 0.25");
  if (options.voxels != "occupied" && options.voxels != "observed")
    return not_allowed("--voxels", options.voxels, "occupied or observed");
  return {};
}

/// Fails iff an option does not apply to the format.
Outcome<void> check_together(const ExportOptions& options) {
  const ExportOptions by_default;
  const auto only_for = [&](const char* option, const char* format) {
    return Failure{std::string(option) + " is for " + format +
                   "; leave it out, or choose --format " + format};
  };
  if (options.format != "png") {
    if (options.view != by_default.view) return only_for("--view", "png");
    if (options.width_px != by_default.width_px) return only_for("--width", "png");
    if (!options.title.empty()) return only_for("--title", "png");
  }
  if (options.format != "ply" && options.ply_form != by_default.ply_form)
    return only_for("--ply-form", "ply");
  if (options.voxels != "occupied" && !options.is_table()) {
    return Failure{
        "--voxels is for pcd, npy and csv; bt and ot have all observed voxels, png and "
        "ply the occupied ones"};
  }
  if (options.format == "csv" && options.layer.of.empty() && options.layer.show != "class")
    return Failure{"--show " + options.layer.show +
                   " is for colours, and csv has none; leave it out, or choose another --format"};
  if (!options.is_octree()) return {};
  if (options.layer.show != "class")
    return Failure{"--show is for colours, and " + options.format +
                   " has none; leave it out, or choose another --format"};
  if (options.min_probability > 0.0 || options.max_variance < 0.25) {
    return Failure{"--min-probability and --max-variance are for labels, and " + options.format +
                   " has none; leave them out, or choose another --format"};
  }
  if (can_write_octrees()) return {};
  return Failure{"--format " + options.format +
                 " needs OctoMap, which this build does not have; install liboctomap-dev and "
                 "build again"};
}

}  // namespace

Outcome<void> check_export(const ExportOptions& options) {
  const Outcome<void> values = check_values(options);
  if (!values.ok()) return values.failure();
  const Outcome<void> together = check_together(options);
  if (!together.ok()) return together.failure();
  if (options.out.empty()) return Failure{"--out has no name; name the file to write"};
  const Outcome<void> layer = check_layer(options.layer);
  if (!layer.ok()) return layer.failure();
  std::vector<NamedFile> inputs = files_of(options.layer.of, options.layer.transforms, "--of");
  inputs.push_back({"--map", options.map});
  return check_outputs({{"--out", options.out}, {"--report", options.report}}, inputs);
}

std::string title_of(const ExportOptions& options) {
  if (!options.title.empty()) return options.title;
  const std::string name = std::filesystem::path(options.map).filename().string();
  return options.layer.show == "class" ? name : name + ": " + options.layer.show;
}

Json to_json(const ExportOptions& options) {
  return {{"map", options.map},
          {"format", options.format},
          {"out", options.out},
          {"report", options.report},
          {"show", options.layer.show},
          {"of", options.layer.of},
          {"transform", options.layer.transforms},
          {"view", options.view},
          {"width", options.width_px},
          {"title", title_of(options)},
          {"ply_form", options.ply_form},
          {"voxels", options.voxels},
          {"min_evidence", options.min_evidence},
          {"min_probability", options.min_probability},
          {"max_variance", options.max_variance}};
}

void declare_export_options(CLI::App& command, ExportOptions& o) {
  command.add_option("--map", o.map, "Map file")->required();
  command.add_option("--format", o.format, "png, ply, pcd, npy, csv, bt or ot")->required();
  command.add_option("--out", o.out, "File to write")->required();
  command.add_option("--report", o.report, "JSON report to write");
  declare_layer_options(command, o.layer);
  command.add_option("--view", o.view, "png: both, top or oblique")->capture_default_str();
  command.add_option("--width", o.width_px, "png: pixels, 600 to 6000")
      ->check(whole_number<int>())
      ->capture_default_str();
  command.add_option("--title", o.title, "png: the line above [the map file's name]");
  command.add_option("--ply-form", o.ply_form, "ply: points or cubes")->capture_default_str();
  command
      .add_option("--voxels", o.voxels, "pcd, npy, csv: occupied, or observed: also free voxels")
      ->capture_default_str();
  command.add_option("--min-evidence", o.min_evidence, "Leave out voxels with less evidence")
      ->check(decimal_number())
      ->capture_default_str();
  command.add_option("--min-probability", o.min_probability, "Leave out less probable labels")
      ->check(decimal_number())
      ->capture_default_str();
  command.add_option("--max-variance", o.max_variance, "Leave out labels with a larger variance")
      ->check(decimal_number())
      ->capture_default_str();
}

}  // namespace tessera
