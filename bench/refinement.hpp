// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What it costs to find the frame between two robots from what they have published, and to find it
// anew when some blocks have changed.
#pragma once

#include <string>

#include "harness.hpp"

namespace tessera::bench {

struct RefinementOptions {
  std::string dataset;
  int first = 0;
  int last = 5;  ///< The first half of the scans is one robot, the rest the other.
  double resolution_m = 0.1;
  double max_range_m = 0.0;  ///< 0: no limit.
};

/// Prints a table of searches: CPU, the longest step, and how many blocks were read.
[[nodiscard]] Outcome<void> measure_refinement(const RefinementOptions& options);

}  // namespace tessera::bench
