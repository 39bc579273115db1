// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One run of "eval": every point of the scans is labelled from the map and scored.
#pragma once

#include <string>
#include <vector>

#include "cli/losses.hpp"
#include "cli/overlap.hpp"
#include "maps/scores.hpp"
#include "scans/dataset.hpp"

namespace tessera {

struct Evaluation {
  /// truth, input: folders of labels; input may be kNoLabels. All arguments must outlive this.
  /// classes: of the true labels.
  Evaluation(const Dataset& the_dataset, const LocalMap& the_map,
             const std::vector<OverlapMap>& the_overlap, const std::string& the_truth,
             const DatasetClasses& the_classes, const std::string& the_input)
      : dataset(the_dataset),
        map(the_map),
        overlap(the_overlap),
        truth(the_truth),
        truth_classes(the_classes),
        input(the_input),
        unknown_truth(the_truth),
        unknown_input(the_input) {}

  const Dataset& dataset;
  const LocalMap& map;
  const std::vector<OverlapMap>& overlap;
  const std::string& truth;
  const DatasetClasses& truth_classes;
  const std::string& input;
  Matrix34d T_map_dataset = Matrix34d::Identity();
  double max_range_m = 0.0;  ///< 0: no limit.

  Scores scores{};
  UnknownIdCount unknown_truth;
  UnknownIdCount unknown_input;
  NumberList bad_poses{};        ///< Scans left out.
  std::uint64_t non_finite = 0;  ///< Points left out.
};

/// Fails with kFailure iff a file can no longer be read.
Outcome<void> score_all(Evaluation& run);

/// Prints warnings on stderr for what was left out, and for what makes the scores worth little.
void warn_of_losses(const Evaluation& run);

}  // namespace tessera
