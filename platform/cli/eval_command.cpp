// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera eval: labels the points of scans from a map and compares with ground truth.
#include <cstdio>

#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/command.hpp"
#include "cli/evaluation.hpp"
#include "cli/setting_options.hpp"
#include "maps/open_map.hpp"
#include "scans/transform_file.hpp"

namespace tessera {

namespace {

struct EvalOptions {
  std::string map;
  std::string dataset;
  std::string report;
  std::string truth = "labels";
  std::string input = "predictions";
  std::optional<bool> deskew;
  std::string transform;
  std::vector<std::string> overlap_of;
  std::vector<std::uint16_t> without;
  std::optional<int> first;
  std::optional<int> last;
  std::optional<double> max_range_m;
};

constexpr Setting kEvalRows[] = {
    path_row<&EvalOptions::map>({"--map"}, "Map file",
                                {.value = "MAP.tsm", .required = "a map file"}),
    path_row<&EvalOptions::dataset>({"--dataset"}, "Folder in the KITTI layout",
                                    {.value = "DIR", .required = "a folder"}),
    path_row<&EvalOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
    row<&EvalOptions::first>({"--first"}, "Number of the first scan",
                             {.value = "N", .otherwise = "the first", .allowed = {.least = 0.0}}),
    row<&EvalOptions::last>({"--last"}, "Number of the last scan, itself included",
                            {.value = "N", .otherwise = "the last", .allowed = {.least = 0.0}}),
    row<&EvalOptions::truth>({"--truth"}, "Folder of true labels", {.value = "FOLDER"}),
    row<&EvalOptions::input>({"--input"},
                             "Folder of the labels that the map was made from, cameras or none",
                             {.value = "FOLDER|cameras|none"}),
    row<&EvalOptions::max_range_m>({"--max-range"},
                                   "Leave out points farther from their sensor; 0: no limit",
                                   {.value = "M",
                                    .otherwise = "as the map was made",
                                    .allowed = {.least = 0.0, .what = "metres"}}),
    row<&EvalOptions::deskew>({"--deskew"}, "Correct scans and their points for motion, as for map",
                              {.otherwise = "if there are times"}),
    path_row<&EvalOptions::transform>({"--transform"},
                                      "4x4 matrix, row by row, rigid: dataset to map frame",
                                      {.value = "FILE", .otherwise = "the identity"}),
};
constexpr SettingTable<EvalOptions> kEvalSettings{kEvalRows};

/// A row of the table: without an input there is no gain.
void print_row(const char* name, double input, double map, bool has_input) {
  if (has_input)
    std::printf("  %-16s %8.4f %8.4f %+8.2f\n", name, input, map, 100.0 * (map - input));
  else
    std::printf("  %-16s %8s %8.4f %8s\n", name, "-", map, "-");
}

void print_scores(const Scores& scores, const ClassTable& classes, bool has_input) {
  const int C = classes.num_classes();
  std::printf("%llu points with labelled truth\n",
              static_cast<unsigned long long>(scores.points()));
  std::printf(
      "  accuracy %.4f, coverage %.5f, in any occupied voxel %.5f, calibration error %.4f\n",
      scores.accuracy(), scores.coverage(), scores.coverage_any(),
      scores.reliability().calibration_error());
  std::printf("  Brier score %.4f, area under the risk-coverage curve %.4f\n",
              scores.reliability().brier_score(), scores.reliability().risk_coverage_area());
  std::printf("  %-16s %8s %8s %8s\n", "IoU", "input", "map", "gain");
  print_row("mean", scores.input().mean_iou(C), scores.map().mean_iou(C), has_input);
  for (int label = 1; label <= C; ++label) {
    if (!scores.map().present(label)) continue;
    print_row(std::string(classes[label].name_view()).c_str(), scores.input().iou(label),
              scores.map().iou(label), has_input);
  }
}

Outcome<void> check_usage(const EvalOptions& options) {
  if (options.truth == kNoLabels || options.truth == kCameraLabels) {
    return Failure{"--truth " + options.truth +
                   " has no labels to compare with; name the folder of the true labels"};
  }
  std::vector<NamedFile> inputs{{"--map", options.map}, {"--transform", options.transform}};
  for (const std::string& path : options.overlap_of) inputs.push_back({"--overlap-of", path});
  return check_outputs({{"--report", options.report}}, inputs,
                       {options.dataset, {options.truth, options.input}});
}

/// Opens the dataset; checks that it has the requested label folders and the map's classes.
Outcome<Dataset> open_dataset(const EvalOptions& options, const ClassTable& classes) {
  const bool cameras = options.input == kCameraLabels;
  Outcome<Dataset> dataset =
      Dataset::open(options.dataset, {.first = options.first,
                                      .last = options.last,
                                      .labels = std::string(cameras ? kCameraLabels : kNoLabels),
                                      .deskew = deskewing(options.deskew)});
  if (!dataset.ok()) return dataset.failure();
  for (const std::string& folder : {options.truth, options.input}) {
    if (folder == kNoLabels || folder == kCameraLabels) continue;
    TESSERA_TRY(dataset->check_labels(folder));
  }
  if (!(dataset->classes().table() == classes)) {
    return Failure{options.map + " was made with other classes than " + options.dataset +
                   " has; evaluate with the data it was made from"};
  }
  return dataset;
}

template <class T>
Json json_of(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

Json report_of(const EvalOptions& options, const Evaluation& run) {
  Json json = run.scores.json(run.map.classes(), options.input != kNoLabels);
  json["max_range"] = run.max_range_m;
  json["non_finite"] = run.non_finite;
  json["bad_poses"] = run.bad_poses.count();
  json["unknown_truth_ids"] = run.unknown_truth.points();
  json["unknown_input_ids"] = run.unknown_input.points();
  json["config"] = {{"map", options.map},
                    {"dataset", options.dataset},
                    {"report", options.report},
                    {"first", json_of(options.first)},
                    {"last", json_of(options.last)},
                    {"truth", options.truth},
                    {"input", options.input},
                    {"deskew", !options.deskew   ? "where timed"
                               : *options.deskew ? "on"
                                                 : "off"},
                    {"max_range", json_of(options.max_range_m)},
                    {"overlap_of", options.overlap_of},
                    {"without", options.without},
                    {"transform", options.transform}};
  return json;
}

Outcome<void> run_eval(const EvalOptions& options) {
  TESSERA_TRY(check_usage(options));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> stored, open_map(options.map));
  TESSERA_TRY_ASSIGN(const Dataset dataset, open_dataset(options, stored->map.classes()));
  TESSERA_TRY_ASSIGN(const std::vector<OverlapMap> overlap,
                     load_overlap(options.overlap_of, *stored, options.map));
  const DatasetClasses truth_classes = dataset.classes().without(options.without);
  Evaluation run(dataset, stored->map, overlap, options.truth, truth_classes, options.input);
  const Json range_m = recorded_setting(stored->header, "max_range");
  run.max_range_m = options.max_range_m.value_or(range_m.is_number() ? range_m.get<double>() : 0.0);
  if (!options.transform.empty()) {
    TESSERA_TRY_ASSIGN(const Matrix34d T, read_transform(options.transform));
    run.T_map_dataset = T;
  }
  TESSERA_TRY(score_all(run));
  warn_of_losses(run);
  print_scores(run.scores, run.map.classes(), options.input != kNoLabels);
  return write_report(report_of(options, run), options.report);
}

}  // namespace

void add_eval_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand(
      "eval", "Label the points of scans from a map and compare with ground truth");
  auto o = std::make_shared<EvalOptions>();
  declare_settings(*command, kEvalSettings, *o);
  command
      ->add_option(
          "--overlap-of", o->overlap_of,
          "Only points where both of these maps have a label, each queried in its own frame")
      ->expected(2)
      ->type_name("MAP.tsm");
  declare_without(*command, o->without);
  command->footer(
      "Example: tessera eval --map map.tsm --dataset semantickitti_08 --last 5 --report eval.json");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_eval(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
