// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a sensor sees that stands in the simulated street, before fences with gaps.
#pragma once

#include "ghost_truth.hpp"

namespace tessera::bench {

struct StandingOptions {
  std::uint64_t seed = 5;
  int scans = 100;
  double period_m = 0.2;  ///< Of a fence's bars; they fill half of it.
  bool true_labels = false;
};

struct StandingScene {
  Scene scene;
  TrueIds ids;
};

/// The street of that seed without traffic, and three fences 4 to 14 m from a sensor of 64 beams.
/// Every scan begins at another angle within a column, as of a scanner that turns freely; the
/// ranges have the scanner's noise. Labels as a network would predict them, or true ones.
StandingScene standing_scene(const StandingOptions& options);

}  // namespace tessera::bench
