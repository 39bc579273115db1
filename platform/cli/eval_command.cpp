// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera eval: labels the points of scans from a map and compares with ground truth.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "cli/command.hpp"
#include "cli/scores.hpp"
#include "cli/stored_map.hpp"
#include "dataset/dataset.hpp"
#include "posix/progress.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

namespace {

struct EvalOptions {
  std::string map;
  std::string dataset;
  std::string report;
  std::string truth = "labels";
  std::string input = "predictions";
  std::string transform;
  std::vector<std::string> overlap_of;
  std::optional<int> first;
  std::optional<int> last;
  std::optional<double> max_range_m;
};

Matrix34d compose(const Matrix34d& a, const Matrix34d& b) {
  Matrix34d result;
  result.leftCols<3>() = a.leftCols<3>() * b.leftCols<3>();
  result.col(3) = a.leftCols<3>() * b.col(3) + a.col(3);
  return result;
}

Matrix34d inverse_of(const Matrix34d& T) {
  Matrix34d result;
  result.leftCols<3>() = T.leftCols<3>().transpose();
  result.col(3) = -(result.leftCols<3>() * T.col(3));
  return result;
}

/// A 4x4 matrix, row-major, of a rigid transform.
Outcome<Matrix34d> read_transform(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Failure{"cannot read " + path + "; name a text file with a 4x4 matrix"};
  Matrix34d T;
  for (int i = 0; i < 12; ++i) {
    if (!(file >> T(i / 4, i % 4)))
      return Failure{path + " does not hold 16 numbers; write a 4x4 matrix, row by row"};
  }
  if (check_rigid(T) != Status::kOk)
    return Failure{path + " is not a rigid transform; its first three rows must be [R | t]"};
  return T;
}

/// The maps between which the overlap is sought, and how to get from the evaluated map's frame into
/// theirs.
struct OverlapMap {
  std::unique_ptr<StoredMap> stored;
  Matrix34d T_own_map = Matrix34d::Identity();
};

Outcome<std::vector<OverlapMap>> load_overlap(const std::vector<std::string>& paths) {
  std::vector<OverlapMap> maps;
  for (const std::string& path : paths) {
    Outcome<std::unique_ptr<StoredMap>> stored = load_map(path);
    if (!stored.ok()) return stored.failure();
    OverlapMap map{std::move(*stored)};
    const MapIdentity& identity = map.stored->header.identity;
    if (identity.has_T_global_map) map.T_own_map = inverse_of(identity.T_global_map);
    maps.push_back(std::move(map));
  }
  return maps;
}

struct EvalRun {
  const EvalOptions& options;
  const Dataset& dataset;
  const LocalMap& map;
  const std::vector<OverlapMap>& overlap;
  Matrix34d T_map_dataset = Matrix34d::Identity();
  double max_range_m = 0.0;
  Scores scores{};
  std::uint64_t non_finite = 0;
};

bool in_overlap(const EvalRun& run, const Point3f& p_map) {
  for (const OverlapMap& other : run.overlap) {
    if (other.stored->map.query(transform(other.T_own_map, p_map.data())).label == 0) return false;
  }
  return true;
}

void score_scan(EvalRun& run, const DatasetScan& scan, std::span<const std::uint8_t> truth,
                std::span<const std::uint8_t> input) {
  const int unlabelled = run.map.classes().unlabelled();
  const Matrix34d T_map_sensor = compose(run.T_map_dataset, scan.T_map_sensor);
  for (std::size_t i = 0; i < scan.num_points(); ++i) {
    if (truth[i] == unlabelled) continue;
    const float* const p_sensor = &scan.points_xyzi[4 * i];
    const double square = static_cast<double>(p_sensor[0]) * static_cast<double>(p_sensor[0]) +
                          static_cast<double>(p_sensor[1]) * static_cast<double>(p_sensor[1]) +
                          static_cast<double>(p_sensor[2]) * static_cast<double>(p_sensor[2]);
    if (!std::isfinite(square)) {
      ++run.non_finite;
      continue;
    }
    if (run.max_range_m > 0.0 && square > run.max_range_m * run.max_range_m) continue;
    const Point3f p_map = transform(T_map_sensor, p_sensor);
    if (!in_overlap(run, p_map)) continue;
    run.scores.add(truth[i], run.map.query(p_map), input[i] == unlabelled ? 0 : input[i]);
  }
}

Outcome<void> score_all(EvalRun& run) {
  ScanBuffer buffer(run.dataset.max_points());
  std::vector<std::uint8_t> truth(run.dataset.max_points());
  std::vector<std::uint8_t> input(run.dataset.max_points());
  Progress progress("evaluating", run.dataset.num_scans());
  for (std::size_t i = 0; i < run.dataset.num_scans(); ++i) {
    const Outcome<DatasetScan> scan = run.dataset.read(i, buffer);
    if (!scan.ok()) return scan.failure();
    const std::size_t n = scan->num_points();
    const Outcome<UnknownRawIds> t =
        run.dataset.read_labels(i, run.options.truth, std::span(truth).first(n));
    if (!t.ok()) return t.failure();
    if (run.options.input == kNoLabels) {
      std::fill(input.begin(), input.end(),
                static_cast<std::uint8_t>(run.map.classes().unlabelled()));
    } else {
      const Outcome<UnknownRawIds> p =
          run.dataset.read_labels(i, run.options.input, std::span(input).first(n));
      if (!p.ok()) return p.failure();
    }
    if (check_rigid(scan->T_map_sensor) == Status::kOk) {
      score_scan(run, *scan, truth, input);
    } else {
      progress.note("warning: a scan was left out: its pose is not a rigid transform");
    }
    progress.update(i + 1);
  }
  progress.finish();
  return {};
}

void print_scores(const Scores& scores, const ClassTable& classes) {
  const int C = classes.num_classes();
  std::printf("%llu points with labelled truth\n",
              static_cast<unsigned long long>(scores.points()));
  std::printf("  mean IoU    input %.4f, map %.4f, gain %+.2f points\n", scores.input().mean_iou(C),
              scores.map().mean_iou(C),
              100.0 * (scores.map().mean_iou(C) - scores.input().mean_iou(C)));
  std::printf(
      "  accuracy %.4f, coverage %.5f, in any occupied voxel %.5f, calibration error %.4f\n",
      scores.accuracy(), scores.coverage(), scores.coverage_any(), scores.calibration_error());
  std::printf("  %-16s %8s %8s %8s\n", "IoU by class", "input", "map", "gain");
  for (int label = 1; label <= C; ++label) {
    if (!scores.map().present(label)) continue;
    std::printf("  %-16s %8.4f %8.4f %+8.2f\n", std::string(classes[label].name_view()).c_str(),
                scores.input().iou(label), scores.map().iou(label),
                100.0 * (scores.map().iou(label) - scores.input().iou(label)));
  }
}

Outcome<void> run_eval(const EvalOptions& options) {
  if (options.max_range_m && !(*options.max_range_m >= 0.0))
    return Failure{"--max-range must be metres, 0 for no limit"};
  const Outcome<void> writable = check_writable(options.report);
  if (!writable.ok()) return writable.failure();
  const Outcome<std::unique_ptr<StoredMap>> stored = load_map(options.map);
  if (!stored.ok()) return stored.failure();
  const Outcome<Dataset> dataset = Dataset::open(
      options.dataset,
      {.first = options.first, .last = options.last, .labels = std::string(kNoLabels)});
  if (!dataset.ok()) return dataset.failure();
  for (const std::string& folder : {options.truth, options.input}) {
    if (folder == kNoLabels) continue;
    const Outcome<void> there = dataset->check_labels(folder);
    if (!there.ok()) return there.failure();
  }
  if (!(dataset->classes().table() == (*stored)->map.classes())) {
    return Failure{options.map + " was made with other classes than " + options.dataset +
                   " has; evaluate with the data it was made from"};
  }
  const Outcome<std::vector<OverlapMap>> overlap = load_overlap(options.overlap_of);
  if (!overlap.ok()) return overlap.failure();
  EvalRun run{.options = options, .dataset = *dataset, .map = (*stored)->map, .overlap = *overlap};
  const Json range_m = recorded_setting((*stored)->header, "max_range");
  run.max_range_m = options.max_range_m.value_or(range_m.is_number() ? range_m.get<double>() : 0.0);
  if (!options.transform.empty()) {
    const Outcome<Matrix34d> T = read_transform(options.transform);
    if (!T.ok()) return T.failure();
    run.T_map_dataset = *T;
  }
  const Outcome<void> scored = score_all(run);
  if (!scored.ok()) return scored.failure();
  if (run.non_finite > 0)
    warn(std::to_string(run.non_finite) + " points were left out: coordinates that are not finite");
  if (run.scores.points() == 0) warn("no point has labelled truth in range; all figures are 0");
  print_scores(run.scores, run.map.classes());
  Json json = run.scores.json(run.map.classes());
  json["max_range"] = run.max_range_m;
  json["config"] = {{"map", options.map},
                    {"dataset", options.dataset},
                    {"truth", options.truth},
                    {"input", options.input},
                    {"overlap_of", options.overlap_of},
                    {"transform", options.transform}};
  return write_report(json, options.report);
}

}  // namespace

void add_eval_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand(
      "eval", "Label the points of scans from a map and compare with ground truth");
  auto o = std::make_shared<EvalOptions>();
  command->add_option("--map", o->map, "Map file")->required();
  command->add_option("--dataset", o->dataset, "Folder in the KITTI layout")->required();
  command->add_option("--report", o->report, "JSON report to write");
  command->add_option("--first", o->first, "First scan number");
  command->add_option("--last", o->last, "Last scan number, inclusive");
  command->add_option("--truth", o->truth, "Folder of true labels")->capture_default_str();
  command->add_option("--input", o->input, "Folder of the labels that the map learnt from, or none")
      ->capture_default_str();
  command->add_option("--max-range", o->max_range_m,
                      "Leave farther points out, m; 0: no limit [as the map was made]");
  command
      ->add_option("--overlap-of", o->overlap_of,
                   "Only points where both of these maps have a label")
      ->expected(2);
  command->add_option("--transform", o->transform, "4x4 matrix, dataset to map frame");
  command->footer(
      "Example: tessera eval --map map.tsm --dataset semantickitti_08 --last 5 --report eval.json");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_eval(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
