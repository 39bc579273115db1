// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/fitted_kernels.hpp"

#include <algorithm>

#include "base/number_text.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "maps/held_mapper.hpp"
#include "maps/score_scan.hpp"
#include "scans/dataset.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// The truth of a scan, and what its own labels say, at its points.
void add_truth(const ScanView& scan, const std::uint8_t* truth, double max_range_m,
               std::uint32_t fold, const LocalMap& map, FittedSet& set) {
  const int unlabelled = map.classes().unlabelled();
  set.non_finite +=
      visit_truth(scan, truth, unlabelled, max_range_m, [&](std::size_t i, const Point3f& p_map) {
        const int input = scan.components == nullptr ? 0 : int{scan.components[i]};
        set.input.add(truth[i], input < unlabelled ? input : 0);
        set.data.samples.add_point(map, p_map, truth[i], fold);
      });
}

}  // namespace

Outcome<FittedSet> read_fit_data(const FitOptions& options, const std::string& path) {
  TESSERA_TRY_ASSIGN(
      const Dataset dataset,
      Dataset::open(path, {.first = options.first, .last = options.last, .labels = options.input}));
  TESSERA_TRY(dataset.check_labels(options.truth));
  const DatasetClasses truth_classes = dataset.classes().without(options.without);
  MapOptions mapping = options.map;
  mapping.inference = InferenceMode::kLattice;
  mapping.free_space = false;  // it does not change what votes say
  TESSERA_TRY_ASSIGN(MapSetup setup, set_up(mapping));
  if (!setup.map.label_votes)
    return not_allowed(
        kMapSettings["--resolution"], text_of(setup.map.resolution_m),
        "metres under " + text_of(kVotesBelow_m) + ", as larger voxels have no votes");
  TESSERA_TRY_ASSIGN(const ScanCapacity capacity, split_budget(setup, dataset.max_points()));
  TESSERA_TRY_ASSIGN(HeldMapper mapper, make_mapper(setup, capacity, dataset.classes().table()));
  TESSERA_TRY_ASSIGN(ScanReader reader, ScanReader::make(dataset));
  FittedSet set;
  set.data.classes = dataset.classes().table();
  set.data.folds =
      static_cast<std::uint32_t>(std::min<std::size_t>(dataset.num_scans(), kMostFolds));
  std::vector<std::uint8_t> truth(dataset.max_points());
  UnknownIdCount unknown(options.truth);
  UnknownIdCount unknown_input(options.input);
  Progress progress("mapping", dataset.num_scans());
  for (std::size_t i = 0; i < dataset.num_scans(); ++i) {
    TESSERA_TRY_ASSIGN(const ScanView scan, reader.read(i));
    unknown_input.add(dataset.scan_number(i), reader.scan().unknown);
    if (check_rigid(scan.T_map_sensor) != Status::kOk) {
      set.bad_poses.add(dataset.scan_number(i));
      continue;
    }
    TESSERA_TRY_ASSIGN(
        const UnknownRawIds ids,
        dataset.read_labels(i, options.truth, truth_classes, std::span(truth).first(scan.count)));
    unknown.add(dataset.scan_number(i), ids);
    const ScanReport report = mapper->integrate(scan, 0);
    if (report.refused_memory() + report.over_capacity != 0)
      return Failure{Message(kMapSettings["--memory"]) + " " + bytes_text(mapping.memory_bytes) +
                     " is too small for the scans of " + path +
                     "; give more, or choose fewer scans"};
    const auto fold = static_cast<std::uint32_t>(i * set.data.folds / dataset.num_scans());
    add_truth(scan, truth.data(), mapping.max_range_m, fold, mapper->map(), set);
    progress.update(i + 1);
  }
  progress.finish();
  for (const UnknownIdCount* const ids : {&unknown, &unknown_input})
    if (ids->points() > 0) warn(ids->text());
  if (set.bad_poses.count() > 0) warn(text_of_bad_poses(set.bad_poses));
  if (set.non_finite > 0) warn(counted(set.non_finite, "point") + " left out, not finite");
  TESSERA_TRY(set.data.samples.read_votes(mapper->map()));
  if (set.data.samples.octets().empty() || set.data.samples.votes().empty())
    return Failure{path +
                   " has no points with labels and a labelled truth; kernels cannot be "
                   "fitted to it"};
  return set;
}

FitResult fit_all(const std::vector<FitData>& data, const KernelFit& fit) {
  std::uint64_t folds = 0;
  for (const FitData& set : data) folds += set.folds > 1 ? set.folds : 0;
  Progress progress("fitting", 1 + folds);
  const KernelChoice one = fit.of_one({});
  const KernelChoice by_name = fit.of_tables();
  const KernelChoice start = fit.start_of({});
  const auto score_of = [&fit](const KernelChoice& choice) { return *fit.score(choice, {}); };
  FitResult result;
  result.fitted = fit.fit(start, {});
  result.one = score_of(one);
  result.by_name = score_of(by_name);
  result.by_class = score_of(result.fitted);
  double apart_one = 0.0;
  double apart_by_class = 0.0;
  int sets = 0;
  std::uint64_t done = 0;
  progress.update(1);
  for (std::size_t set = 0; set < data.size(); ++set) {
    double of_one = 0.0;
    double of_fitted = 0.0;
    int with_truth = 0;
    for (std::uint32_t fold = 0; data[set].folds > 1 && fold < data[set].folds; ++fold) {
      progress.update(1 + ++done);
      const FitPart rest{.set = set, .fold = fold, .alone = false};
      const FitPart apart{.set = set, .fold = fold, .alone = true};
      const std::optional<double> before = fit.score(one, apart);
      if (!before) continue;
      of_one += *before;
      of_fitted += fit.score(fit.fit(start, rest), apart).value_or(0.0);
      ++with_truth;
    }
    if (with_truth < 2) continue;
    apart_one += of_one / with_truth;
    apart_by_class += of_fitted / with_truth;
    ++sets;
  }
  progress.finish();
  if (sets == 0) return result;
  result.apart_one = apart_one / sets;
  result.apart_by_class = apart_by_class / sets;
  return result;
}

}  // namespace tessera
