// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/evaluation.hpp"

#include <algorithm>

#include "base/number_text.hpp"
#include "base/progress.hpp"
#include "cli/command.hpp"
#include "maps/score_scan.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

namespace {

/// Reads the labels of a scan from the folder; kNoLabels returns unlabelled ones.
Outcome<void> read_labels(const Dataset& dataset, std::size_t i, const std::string& folder,
                          const DatasetClasses& classes, std::span<std::uint8_t> out,
                          UnknownIdCount& unknown) {
  if (folder == kNoLabels) {
    std::fill(out.begin(), out.end(), dataset.classes().unlabelled());
    return {};
  }
  TESSERA_TRY_ASSIGN(const UnknownRawIds ids, dataset.read_labels(i, folder, classes, out));
  unknown.add(dataset.scan_number(i), ids);
  return {};
}

}  // namespace

Outcome<void> score_all(Evaluation& run) {
  const Dataset& dataset = run.dataset;
  TESSERA_TRY_ASSIGN(ScanReader reader, ScanReader::make(dataset));
  std::vector<std::uint8_t> truth(dataset.max_points());
  std::vector<std::uint8_t> input(dataset.max_points());
  Progress progress("evaluating", dataset.num_scans());
  for (std::size_t i = 0; i < dataset.num_scans(); ++i) {
    TESSERA_TRY_ASSIGN(const ScanView scan, reader.read(i));
    const std::size_t n = scan.count;
    TESSERA_TRY(read_labels(dataset, i, run.truth, run.truth_classes, std::span(truth).first(n),
                            run.unknown_truth));
    if (run.input == kCameraLabels) {
      std::copy_n(scan.components, n, input.begin());
    } else {
      TESSERA_TRY(read_labels(dataset, i, run.input, dataset.classes(), std::span(input).first(n),
                              run.unknown_input));
    }
    if (check_rigid(scan.T_map_sensor) == Status::kOk) {
      ScanView view = scan;
      view.T_map_sensor = product(run.T_map_dataset, scan.T_map_sensor);
      view.components = input.data();
      const auto is_wanted = [&run](const Point3f& p_map) {
        return in_overlap(run.overlap, p_map);
      };
      run.non_finite +=
          score_scan(run.map, view, truth.data(), run.max_range_m, is_wanted, run.scores);
    } else {
      run.bad_poses.add(reader.scan().number);
    }
    progress.update(i + 1);
  }
  progress.finish();
  return {};
}

void warn_of_losses(const Evaluation& run) {
  if (run.bad_poses.count() > 0) {
    warn(text_of_bad_poses(run.bad_poses));
  }
  for (const UnknownIdCount* const unknown : {&run.unknown_truth, &run.unknown_input}) {
    if (unknown->points() > 0) warn(unknown->text());
  }
  for (const Message& doubt : doubts_of(run.scores, run.map, run.non_finite)) warn(doubt);
}

}  // namespace tessera
