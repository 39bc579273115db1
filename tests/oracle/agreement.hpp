// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How a map compares with the brute-force counts, to the tolerance of the specification: 1e-5
// relative + 1e-6 absolute, the same observed voxels. A contribution within 1e-6 of the cut-off may
// be there or not; it widens the tolerance by what it can weigh instead of taking the voxel out of
// the comparison.
#pragma once

#include <string>

#include "oracle/label_oracle.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {

struct Agreement {
  std::size_t compared = 0;  ///< Counts, that is pairs of voxel and component.
  std::size_t missing = 0;   ///< Voxels that only the oracle observed.
  std::size_t extra = 0;     ///< Voxels that only the map observed.
  std::size_t wrong = 0;     ///< Counts beyond the tolerance.
  double worst = 0.0;        ///< Largest difference as a part of its tolerance.
  std::string first;         ///< What the first disagreement was.

  [[nodiscard]] bool holds() const { return compared > 0 && missing + extra + wrong == 0; }
  [[nodiscard]] std::string text() const;
};

[[nodiscard]] Agreement compare(const LocalMap& map, const LabelOracle& oracle, double min_weight);

}  // namespace tessera::oracle
