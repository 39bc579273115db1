// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The data sets that "fit-kernels" learns from: each is mapped, and its true labels are read.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/losses.hpp"
#include "maps/kernel_fit.hpp"
#include "maps/scores.hpp"
#include "settings/map_options.hpp"

namespace tessera {

struct FitOptions {
  std::vector<std::string> datasets;
  std::string out;
  std::string report;
  std::string truth = "labels";
  std::string input = "predictions";
  std::optional<int> first;
  std::optional<int> last;
  std::vector<std::uint16_t> without;  ///< Raw ids of the truth that do not count.
  MapOptions map;                      ///< Resolution, range and memory.
};

/// The folds that the scans of a data set are left out in, at most.
inline constexpr std::uint32_t kMostFolds = 10;

struct FittedSet {
  FitData data;
  Confusion input;               ///< Of the labels that the map is made from.
  NumberList bad_poses;          ///< Scans left out.
  std::uint64_t non_finite = 0;  ///< Points left out.
};

/// Maps a data set in the mode lattice and reads its votes; warns on stderr of what is left out.
/// Fails as map and eval do, and with kUsage iff the memory does not hold all of it. Uses up to
/// twice 76 bytes beside that for each class around each octet with true labels, 36 for each octet,
/// true class and fold of scans, and 32 for each octet; and 50 MB.
Outcome<FittedSet> read_fit_data(const FitOptions& options, const std::string& dataset);

/// What a fit gains.
struct FitResult {
  KernelChoice fitted;
  double input = 0.0;     ///< Mean IoU of the labels that maps are made from,
  double one = 0.0;       ///< of one kernel for all classes,
  double by_name = 0.0;   ///< of those by the names of classes,
  double by_class = 0.0;  ///< and of the fitted ones.
  /// Of folds of scans, each labelled by kernels that were fitted without its truth: the mean over
  /// the data sets of the means over their folds. Nothing iff no data set has two folds with truth.
  std::optional<double> apart_one;
  std::optional<double> apart_by_class;
};
FitResult fit_all(const std::vector<FitData>& data, const KernelFit& fit);

}  // namespace tessera
