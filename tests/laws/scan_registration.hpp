// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where each return of a scan lies and which returns a thinned point stands for: found by a roomy
// integrator that does not thin, and checked against the definition in double precision.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laws/scan_cases.hpp"

namespace tessera::oracle {

/// The returns of one cell of the thinning grid, or a single return where thinning is off.
struct Group {
  std::vector<std::size_t> returns;  ///< In ascending order.
  float weight = 0.0F;               ///< Of the first return, and its component.
  std::uint8_t component = 0;
  Point3d centroid_map = Point3d::Zero();
  bool taken = false;
};

struct Registration {
  ScanReport report{};
  std::vector<Group> points;  ///< Of returns in range.
  std::vector<Group> rays;    ///< Of returns beyond the range; none without free space.
  std::size_t in_range = 0;
};

/// Fills `into`; what is wrong with the library's registration, if anything is.
[[nodiscard]] std::optional<std::string> register_scan(const ScanCase& scan_case,
                                                       const std::vector<Return>& returns,
                                                       Registration& into);

/// The returns of the groups that the kept points stand for, marked in chosen; false if a kept
/// point is none of theirs.
[[nodiscard]] bool choose_returns(std::vector<Group>& groups, std::span<const ScanPoint> kept,
                                  std::vector<bool>& chosen);

}  // namespace tessera::oracle
