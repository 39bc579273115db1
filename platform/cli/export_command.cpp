// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera export: a map as a picture (PNG) or for other tools.
#include <cstdio>

#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "cli/export_options.hpp"
#include "cli/export_table.hpp"
#include "maps/octree_writer.hpp"
#include "maps/open_map.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

ExportedVoxels exported_voxels(const LocalMap& map, const ExportOptions& options) {
  ExportedVoxels exported;
  std::vector<KeyedIndex> workspace = workspace_for(map);
  for_each_observed(map, workspace, [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
    const Estimate e = estimate(evidence, map.reading());
    if (options.is_exported(e)) exported.add(map.lattice(), voxel, e);
  });
  return exported;
}

Outcome<WriteReport> write_picture(double resolution_m, const std::vector<PlyVoxel>& voxels,
                                   const Layer& layer, const ExportOptions& options) {
  std::vector<RenderVoxel> colored;
  colored.reserve(voxels.size());
  for (const PlyVoxel& v : voxels) colored.push_back({v.x, v.y, v.z, v.color});
  ImageOptions image;
  image.width_px = options.width_px;
  image.title = title_of(options);
  if (options.is_limited()) image.empty_note = "no voxel passes the limits";
  image.view = options.view == "top" ? View::kTop
                                     : (options.view == "oblique" ? View::kOblique : View::kBoth);
  image.legend = layer.legend;
  return write_png(colored, static_cast<float>(resolution_m), image, options.out);
}

void warn_of_losses(const ExportOptions& options, std::size_t voxels, const WriteReport& written) {
  if (voxels == 0) {
    warn(options.is_limited()
             ? "no occupied voxel passes --min-evidence " + text_of(options.min_evidence) +
                   ", --min-probability " + text_of(options.min_probability) +
                   " and --max-variance " + text_of(options.max_variance)
             : std::string("the map has no occupied voxel"));
  }
  if (written.left_out > 0) {
    warn(counted(written.left_out, "voxel") +
         (options.format == "png" ? " not shown in each view: too far from the others, the picture "
                                    "would shrink"
                                  : " left out: no finite coordinates"));
  }
}

const char* kind_of(const ExportOptions& options) {
  if (options.voxels == "observed") return "observed voxel";
  return options.layer.shows_moved() ? "voxel" : "occupied voxel";
}

Json report_of(const ExportOptions& options, const WriteReport& written, const Json& counts) {
  Json json = {{"voxels", written.voxels},
               {"left_out", written.left_out},
               {"format", options.format},
               {"out", options.out}};
  json.update(counts);
  json["config"] = to_json(options);
  return json;
}

/// Writes pictures and PLY, which need all voxels at once.
Outcome<void> export_collected(ExportOptions& options, const StoredMap& stored) {
  const LocalMap& map = stored.map;
  const double resolution_m = map.lattice().resolution_m();
  ExportedVoxels exported = exported_voxels(map, options);
  ColoringChoice choice(options.layer.show);
  for (const PlyVoxel& voxel : exported.voxels) choice.add(voxel.z, voxel.label);
  const Coloring coloring = choice.take();
  options.layer.show = coloring.show;  // for the title and the report too
  TESSERA_TRY_ASSIGN(const Layer layer,
                     color_voxels(options.layer, coloring, stored, options.map, exported));
  const std::vector<PlyVoxel>& voxels = exported.voxels;
  const PlyForm form = options.ply_form == "cubes" ? PlyForm::kCubes : PlyForm::kPoints;
  TESSERA_TRY_ASSIGN(const WriteReport written,
                     options.format == "png"
                         ? write_picture(resolution_m, voxels, layer, options)
                         : write_ply(voxels, static_cast<float>(resolution_m), options.out, form,
                                     label_names(map.classes())));
  std::printf("%s into %s\n", counted(written.voxels, kind_of(options)).c_str(),
              options.out.c_str());
  warn_of_losses(options, voxels.size(), written);
  return write_report(report_of(options, written, layer.counts), options.report);
}

Outcome<void> export_table(ExportOptions& options, const StoredMap& stored) {
  const Selection selection = select_voxels(options, stored.map);
  options.layer.show = selection.coloring.show;
  TESSERA_TRY_ASSIGN(const Json counts, write_table(options, selection, stored));
  std::printf("%s into %s\n", counted(selection.voxels, kind_of(options)).c_str(),
              options.out.c_str());
  warn_of_losses(options, selection.voxels, {});
  return write_report(report_of(options, {.voxels = selection.voxels}, counts), options.report);
}

Outcome<void> export_octree(const ExportOptions& options, const StoredMap& stored) {
  const OctreeForm form = options.format == "bt" ? OctreeForm::kBinary : OctreeForm::kFull;
  TESSERA_TRY_ASSIGN(
      const OctreeReport written,
      write_octree(stored.map, {.form = form, .min_evidence = options.min_evidence}, options.out));
  const std::uint64_t voxels = written.occupied + written.free;
  std::printf("%s, %llu of them free, as %s into %s\n", counted(voxels, "voxel").c_str(),
              static_cast<unsigned long long>(written.free), counted(written.nodes, "node").c_str(),
              options.out.c_str());
  warn_of_losses(options, written.occupied, {});
  const Json counts = {{"occupied_voxels", written.occupied},
                       {"free_voxels", written.free},
                       {"nodes", written.nodes}};
  return write_report(report_of(options, {.voxels = voxels}, counts), options.report);
}

Outcome<void> run_export(ExportOptions options) {
  choose_format(options);
  TESSERA_TRY(check_export(options));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> stored, open_map(options.map));
  options.layer.moving = stored->map.classes().moving();
  if (options.is_octree()) return export_octree(options, *stored);
  return options.is_table() ? export_table(options, *stored) : export_collected(options, *stored);
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("export", "Write a picture of a map, or its voxels for other tools");
  auto o = std::make_shared<ExportOptions>();
  declare_export_options(*command, *o);
  command->footer("Example: tessera export --map map.tsm --format png --out map.png");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_export(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
