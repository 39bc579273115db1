// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/export_options.hpp"

#include <algorithm>
#include <filesystem>

#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/setting_options.hpp"
#include "maps/fuse_sessions.hpp"
#include "maps/octree_writer.hpp"

namespace tessera {

namespace {

constexpr std::array<std::string_view, 7> kFormats{"png", "ply", "pcd", "npy", "csv", "bt", "ot"};
constexpr std::array<std::string_view, 3> kViews{"both", "top", "oblique"};
constexpr std::array<std::string_view, 2> kPlyForms{"points", "cubes"};
constexpr std::array<std::string_view, 2> kVoxels{"occupied", "observed"};

constexpr Setting kExportRows[] = {
    path_row<&ExportOptions::map>({"--map"}, "Map file",
                                  {.value = "MAP.tsm", .required = "a map file"}),
    row<&ExportOptions::format>({"--format"}, "Format of the file",
                                {.otherwise = "the ending of --out", .choices = kFormats}),
    path_row<&ExportOptions::out>({"--out"}, "File to write",
                                  {.value = "FILE", .required = "a file"}),
    path_row<&ExportOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<ExportOptions> kExportSettings{kExportRows};
constexpr Setting kShapeRows[] = {
    row<&ExportOptions::view>({"--view"}, "png: what the picture shows", {.choices = kViews}),
    row<&ExportOptions::width_px>(
        {"--width"}, "png: width of the picture",
        {.value = "PX",
         .allowed = from_to(ImageOptions::kMinWidthPx, ImageOptions::kMaxWidthPx, "pixels")}),
    row<&ExportOptions::title>({"--title"},
                               "png: the line above, in ASCII; the middle of a longer one is cut",
                               {.value = "TEXT", .otherwise = "the map file's name"}),
    row<&ExportOptions::ply_form>({"--ply-form"}, "ply: a point or a cube for each voxel",
                                  {.choices = kPlyForms}),
    row<&ExportOptions::voxels>({"--voxels"}, "pcd, npy, csv: observed has free voxels too",
                                {.choices = kVoxels}),
    row<&ExportOptions::min_evidence>({"--min-evidence"}, "Leave out voxels with less evidence",
                                      {.value = "S", .allowed = from_to(0.0, 1e6)}),
    row<&ExportOptions::min_probability>({"--min-probability"},
                                         "Leave out voxels whose label is less probable",
                                         {.value = "P", .allowed = from_to(0.0, 1.0)}),
    row<&ExportOptions::max_variance>({"--max-variance"},
                                      "Leave out voxels whose label has a larger variance",
                                      {.value = "V", .allowed = from_to(0.0, 0.25)}),
};
constexpr SettingTable<ExportOptions> kShapeSettings{kShapeRows};

constexpr std::array<std::string_view, 7> kShown{
    "class", "contributors", "disagreement", "variance", "probability", "height", "moved"};
constexpr Setting kLayerRows[] = {
    row<&LayerOptions::show>(
        {"--show"}, "What colours show",
        {.otherwise = "class; height if no voxel has a label", .choices = kShown}),
};
constexpr SettingTable<LayerOptions> kLayerSettings{kLayerRows};

void declare_layer_options(CLI::App& command, LayerOptions& options) {
  declare_settings(command, kLayerSettings, options);
  command
      .add_option("--of", options.of,
                  "The local maps that the global map was made of, to show contributors or "
                  "disagreement")
      ->type_name("MAP.tsm");
  command
      .add_option("--session", options.sessions,
                  "A map of an earlier day that the global map was made of too, as given to fuse")
      ->allow_extra_args(false)
      ->type_name("MAP.tsm[:WEIGHT]");
  command
      .add_option("--transform", options.transforms,
                  "4x4 matrix T_global_map of a map of --of or --session, as given to fuse "
                  "[stored in the map, else the identity]")
      ->allow_extra_args(false)
      ->type_name("MAP.tsm=T.txt");
}

/// The format that the ending of a file's name says; empty: none.
std::string format_of(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending.empty()) return {};
  const auto* const format = std::find(kFormats.begin(), kFormats.end(), ending.substr(1));
  return format == kFormats.end() ? std::string() : std::string(*format);
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
  const std::string show = options.layer.show_or_class();
  if (options.format == "csv" && options.layer.of.empty() && show != "class")
    return Failure{"--show " + show +
                   " is for colours, and csv has none; leave it out, or choose another --format"};
  if (!options.is_octree()) return {};
  if (show != "class")
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

void choose_format(ExportOptions& options) {
  if (options.format.empty()) options.format = format_of(options.out);
}

Outcome<void> check_export(const ExportOptions& options) {
  if (options.out.empty()) return Failure{"--out has no name; name the file to write"};
  const std::string ending = format_of(options.out);
  if (options.format.empty())
    return Failure{"--out " + options.out +
                   " does not end as a format; give --format png, ply, pcd, npy, csv, bt or ot"};
  TESSERA_TRY(check_together(options));
  if (!ending.empty() && ending != options.format)
    return Failure{"--out " + options.out + " ends as " + ending + ", but --format is " +
                   options.format + "; leave --format out, or choose another name"};
  TESSERA_TRY(check_layer(options.layer));
  std::vector<NamedFile> inputs = files_of(options.layer.of, options.layer.transforms, "--of");
  inputs.push_back({"--map", options.map});
  std::vector<std::string> transforms = options.layer.transforms;
  TESSERA_TRY_ASSIGN(const std::vector<SessionOptions> sessions,
                     parse_sessions(options.layer.sessions, transforms));
  for (const SessionOptions& session : sessions) inputs.push_back({kSessionSetting, session.file});
  return check_outputs({{"--out", options.out}, {"--report", options.report}}, inputs);
}

std::string title_of(const ExportOptions& options) {
  if (!options.title.empty()) return options.title;
  const std::string name = std::filesystem::path(options.map).filename().string();
  const std::string show = options.layer.show_or_class();
  return show == "class" ? name : name + ": " + show;
}

Json to_json(const ExportOptions& options) {
  return {{"map", options.map},
          {"format", options.format},
          {"out", options.out},
          {"report", options.report},
          {"show", options.layer.show_or_class()},
          {"of", options.layer.of},
          {"session", options.layer.sessions},
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
  declare_settings(command, kExportSettings, o);
  declare_layer_options(command, o.layer);
  declare_settings(command, kShapeSettings, o);
}

}  // namespace tessera
