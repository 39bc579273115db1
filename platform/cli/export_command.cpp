// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera export: a map for people's eyes (PNG) and for other tools (PLY).
#include <cstdio>

#include "cli/command.hpp"
#include "cli/report.hpp"
#include "cli/stored_map.hpp"
#include "render/ply.hpp"
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
};

/// What occupied voxels without a label look like.
constexpr Color kUnlabelledColor{128, 128, 128};

std::vector<PlyVoxel> occupied_voxels(const LocalMap& map, const ExportOptions& options) {
  std::vector<PlyVoxel> voxels;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    const Estimate e = estimate(evidence, map.config().prior);
    if (e.state != VoxelState::kOccupied || e.evidence < options.min_evidence) return;
    if (e.label != 0 && e.probability < options.min_probability) return;
    const Point3d center = map.lattice().center_of(voxel);
    voxels.push_back({.x = static_cast<float>(center.x()),
                      .y = static_cast<float>(center.y()),
                      .z = static_cast<float>(center.z()),
                      .color = e.label == 0 ? kUnlabelledColor : map.classes()[e.label].color,
                      .label = static_cast<std::uint8_t>(e.label),
                      .probability = static_cast<float>(e.probability),
                      .variance = static_cast<float>(e.variance),
                      .evidence = static_cast<float>(e.evidence)});
  });
  return voxels;
}

Outcome<WriteReport> write_picture(const LocalMap& map, const std::vector<PlyVoxel>& voxels,
                                   const ExportOptions& options) {
  std::vector<RenderVoxel> colored;
  colored.reserve(voxels.size());
  for (const PlyVoxel& v : voxels) colored.push_back({v.x, v.y, v.z, v.color});
  ImageOptions image;
  image.width_px = options.width_px;
  image.title = options.title.empty() ? options.map : options.title;
  image.view = options.view == "top" ? View::kTop
                                     : (options.view == "oblique" ? View::kOblique : View::kBoth);
  for (int label = 1; label <= map.classes().num_classes(); ++label) {
    image.legend.push_back(
        {std::string(map.classes()[label].name_view()), map.classes()[label].color});
  }
  image.legend.push_back({"no label", kUnlabelledColor});
  return write_png(colored, static_cast<float>(map.lattice().resolution_m()), image, options.out);
}

Outcome<void> run_export(const ExportOptions& options) {
  if (options.format != "ply" && options.format != "png") {
    return Failure{"--format " + options.format + " is not known; give ply or png"};
  }
  if (options.view != "both" && options.view != "top" && options.view != "oblique") {
    return Failure{"--view " + options.view + " is not known; give both, top or oblique"};
  }
  if (options.ply_form != "points" && options.ply_form != "cubes") {
    return Failure{"--ply-form " + options.ply_form + " is not known; give points or cubes"};
  }
  if (options.width_px < ImageOptions::kMinWidthPx ||
      options.width_px > ImageOptions::kMaxWidthPx) {
    return Failure{"--width must be from 200 to 6000 pixels"};
  }
  const Outcome<void> writable = check_writable(options.report);
  if (!writable.ok()) return writable.failure();
  const Outcome<std::unique_ptr<StoredMap>> stored = load_map(options.map);
  if (!stored.ok()) return stored.failure();
  const LocalMap& map = (*stored)->map;
  const std::vector<PlyVoxel> voxels = occupied_voxels(map, options);
  const PlyForm form = options.ply_form == "cubes" ? PlyForm::kCubes : PlyForm::kPoints;
  const Outcome<WriteReport> written =
      options.format == "png"
          ? write_picture(map, voxels, options)
          : write_ply(voxels, static_cast<float>(map.lattice().resolution_m()), options.out, form);
  if (!written.ok()) return written.failure();
  std::printf("%llu occupied voxels into %s\n", static_cast<unsigned long long>(written->voxels),
              options.out.c_str());
  if (voxels.empty()) warn("the map has no occupied voxel");
  return write_report(
      {{"voxels", written->voxels}, {"format", options.format}, {"out", options.out}},
      options.report);
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
  command->add_option("--view", o->view, "png: both, top or oblique")->capture_default_str();
  command->add_option("--width", o->width_px, "png: pixels")->capture_default_str();
  command->add_option("--title", o->title, "png: the line above [the map's name]");
  command->add_option("--ply-form", o->ply_form, "ply: points or cubes")->capture_default_str();
  command->add_option("--min-evidence", o->min_evidence, "Leave voxels with less evidence out")
      ->capture_default_str();
  command->add_option("--min-probability", o->min_probability, "Leave less probable labels out")
      ->capture_default_str();
  command->footer("Example: tessera export --map map.tsm --format png --out map.png");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_export(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
