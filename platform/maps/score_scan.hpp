// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compares a map with a scan that has true labels.
#pragma once

#include <cmath>
#include <cstdint>

#include "maps/scores.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// Calls visit(i, p_map) for each point with a labelled truth. truth: a component for each point.
/// Ignores points farther than max_range_m from their sensor (0: no limit). The pose must be rigid.
/// Returns the number of points that were left out because they are not finite.
template <class Visit>
std::uint64_t visit_truth(const ScanView& scan, const std::uint8_t* truth, int unlabelled,
                          double max_range_m, Visit&& visit) {
  std::uint64_t non_finite = 0;
  for (std::size_t i = 0; i < scan.count; ++i) {
    if (truth[i] == 0 || truth[i] >= unlabelled) continue;
    const float* const p_sensor = scan.points + i * scan.stride_floats;
    const double square = static_cast<double>(p_sensor[0]) * static_cast<double>(p_sensor[0]) +
                          static_cast<double>(p_sensor[1]) * static_cast<double>(p_sensor[1]) +
                          static_cast<double>(p_sensor[2]) * static_cast<double>(p_sensor[2]);
    if (!std::isfinite(square)) {
      ++non_finite;
      continue;
    }
    if (max_range_m > 0.0 && square > max_range_m * max_range_m) continue;
    visit(i, transform(scan.T_map_sensor, p_sensor));
  }
  return non_finite;
}

/// scan: its components are the labels that the map was made from; null: none. Ignores points as
/// visit_truth(), and those for which is_wanted(p_map) is false. Returns as it does.
template <class IsWanted>
std::uint64_t score_scan(const LocalMap& map, const ScanView& scan, const std::uint8_t* truth,
                         double max_range_m, IsWanted&& is_wanted, Scores& scores) {
  const int unlabelled = map.classes().unlabelled();
  return visit_truth(
      scan, truth, unlabelled, max_range_m, [&](std::size_t i, const Point3f& p_map) {
        if (!is_wanted(p_map)) return;
        const int input = scan.components == nullptr ? 0 : int{scan.components[i]};
        // Any number that is not a class is no label.
        scores.add(truth[i], map.evidence(p_map), map.reading(), input < unlabelled ? input : 0);
      });
}

}  // namespace tessera
