// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera export: a map for people's eyes (PNG) and for other tools (PLY).
#include <cstdio>
#include <filesystem>

#include "cli/command.hpp"
#include "cli/export_layers.hpp"
#include "cli/fuse_inputs.hpp"
#include "cli/number_options.hpp"
#include "mapping/number_text.hpp"
#include "mapping/outputs.hpp"
#include "mapping/report.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

struct ExportOptions {
  std::string map;
  std::string format;
  std::string out;
  std::string report;
  std::string view = "both";
  std::string ply_form = "points";
  std::string title;
  int width_px = ImageOptions{}.width_px;
  double min_evidence = 0.0;
  double min_probability = 0.0;
  double max_variance = 0.25;  ///< No label can have more.
  LayerOptions layer;
};

ExportedVoxels occupied_voxels(const LocalMap& map, const ExportOptions& options) {
  ExportedVoxels exported;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    const Estimate e = estimate(evidence, map.config().prior);
    if (e.state != VoxelState::kOccupied || e.evidence < options.min_evidence) return;
    if (e.label != 0 && e.probability < options.min_probability) return;
    if (is_uncertain(e, options.max_variance)) return;
    const Point3d center = map.lattice().center_of(voxel);
    exported.places.push_back(voxel);
    exported.voxels.push_back({.x = static_cast<float>(center.x()),
                               .y = static_cast<float>(center.y()),
                               .z = static_cast<float>(center.z()),
                               .color = {},
                               .label = static_cast<std::uint8_t>(e.label),
                               .probability = static_cast<float>(e.probability),
                               .variance = static_cast<float>(e.variance),
                               .evidence = static_cast<float>(e.evidence)});
  });
  return exported;
}

std::string title_of(const ExportOptions& options) {
  if (!options.title.empty()) return options.title;
  const std::string name = std::filesystem::path(options.map).filename().string();
  return options.layer.show == "class" ? name : name + ": " + options.layer.show;
}

bool is_limited(const ExportOptions& options) {
  return options.min_evidence > 0.0 || options.min_probability > 0.0 || options.max_variance < 0.25;
}

Outcome<WriteReport> write_picture(double resolution_m, const std::vector<PlyVoxel>& voxels,
                                   const Layer& layer, const ExportOptions& options) {
  std::vector<RenderVoxel> colored;
  colored.reserve(voxels.size());
  for (const PlyVoxel& v : voxels) colored.push_back({v.x, v.y, v.z, v.color});
  ImageOptions image;
  image.width_px = options.width_px;
  image.title = title_of(options);
  if (is_limited(options)) image.empty_note = "no voxel passes the limits";
  image.view = options.view == "top" ? View::kTop
                                     : (options.view == "oblique" ? View::kOblique : View::kBoth);
  image.legend = layer.legend;
  return write_png(colored, static_cast<float>(resolution_m), image, options.out);
}

Failure not_allowed(const char* option, const std::string& given, const std::string& allowed) {
  return {std::string(option) + " " + given + " is not allowed; give " + allowed};
}

Outcome<void> check_usage(const ExportOptions& options) {
  if (options.format != "ply" && options.format != "png")
    return not_allowed("--format", options.format, "ply or png");
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
  if (options.out.empty()) return Failure{"--out has no name; name the file to write"};
  const Outcome<void> layer = check_layer(options.layer);
  if (!layer.ok()) return layer.failure();
  std::vector<NamedFile> inputs = files_of(options.layer.of, options.layer.transforms, "--of");
  inputs.push_back({"--map", options.map});
  return check_outputs({{"--out", options.out}, {"--report", options.report}}, inputs);
}

/// By label; 0 is no label.
std::vector<std::string> label_names(const ClassTable& classes) {
  std::vector<std::string> names(1);
  for (int label = 1; label <= classes.num_classes(); ++label)
    names.emplace_back(classes[label].name_view());
  return names;
}

void warn_of_losses(const ExportOptions& options, std::size_t voxels, const WriteReport& written) {
  if (voxels == 0) {
    warn(is_limited(options)
             ? "no occupied voxel passes --min-evidence " + text_of(options.min_evidence) +
                   ", --min-probability " + text_of(options.min_probability) +
                   " and --max-variance " + text_of(options.max_variance)
             : std::string("the map has no occupied voxel"));
  }
  if (written.left_out > 0) {
    warn(counted(written.left_out, "voxel") +
         (options.format == "png"
              ? " not shown in each view: so far from the rest that the picture "
                "would shrink"
              : " left out: no finite coordinates"));
  }
}

Json report_of(const ExportOptions& options, const WriteReport& written, const Layer& layer) {
  Json json = {{"voxels", written.voxels},
               {"left_out", written.left_out},
               {"format", options.format},
               {"out", options.out}};
  json.update(layer.counts);
  json["config"] = {{"map", options.map},
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
                    {"min_evidence", options.min_evidence},
                    {"min_probability", options.min_probability},
                    {"max_variance", options.max_variance}};
  return json;
}

Outcome<void> run_export(const ExportOptions& options) {
  const Outcome<void> usage = check_usage(options);
  if (!usage.ok()) return usage.failure();
  const Outcome<std::unique_ptr<StoredMap>> stored = load_map(options.map);
  if (!stored.ok()) return stored.failure();
  const LocalMap& map = (*stored)->map;
  const double resolution_m = map.lattice().resolution_m();
  ExportedVoxels exported = occupied_voxels(map, options);
  const Outcome<Layer> layer = color_voxels(options.layer, **stored, options.map, exported);
  if (!layer.ok()) return layer.failure();
  const std::vector<PlyVoxel>& voxels = exported.voxels;
  const PlyForm form = options.ply_form == "cubes" ? PlyForm::kCubes : PlyForm::kPoints;
  const Outcome<WriteReport> written =
      options.format == "png" ? write_picture(resolution_m, voxels, *layer, options)
                              : write_ply(voxels, static_cast<float>(resolution_m), options.out,
                                          form, label_names(map.classes()));
  if (!written.ok()) return written.failure();
  std::printf("%s into %s\n", counted(written->voxels, "occupied voxel").c_str(),
              options.out.c_str());
  warn_of_losses(options, voxels.size(), *written);
  return write_report(report_of(options, *written, *layer), options.report);
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("export", "A picture of the map, or its voxels for other tools");
  auto o = std::make_shared<ExportOptions>();
  command->add_option("--map", o->map, "Map file")->required();
  command->add_option("--format", o->format, "png or ply")->required();
  command->add_option("--out", o->out, "File to write")->required();
  command->add_option("--report", o->report, "JSON report to write");
  declare_layer_options(*command, o->layer);
  command->add_option("--view", o->view, "png: both, top or oblique")->capture_default_str();
  command->add_option("--width", o->width_px, "png: pixels, 600 to 6000")
      ->check(whole_number<int>())
      ->capture_default_str();
  command->add_option("--title", o->title, "png: the line above [the map file's name]");
  command->add_option("--ply-form", o->ply_form, "ply: points or cubes")->capture_default_str();
  command->add_option("--min-evidence", o->min_evidence, "Leave voxels with less evidence out")
      ->check(decimal_number())
      ->capture_default_str();
  command->add_option("--min-probability", o->min_probability, "Leave less probable labels out")
      ->check(decimal_number())
      ->capture_default_str();
  command->add_option("--max-variance", o->max_variance, "Leave more uncertain labels out")
      ->check(decimal_number())
      ->capture_default_str();
  command->footer("Example: tessera export --map map.tsm --format png --out map.png");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_export(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
