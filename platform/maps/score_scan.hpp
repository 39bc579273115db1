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

/// scan: its components are the labels that the map was made from; null: none. truth: a component
/// for each point. Ignores points without a labelled truth, those farther than max_range_m from
/// their sensor (0: no limit), and those for which is_wanted(p_map) is false. The pose must be
/// rigid. Returns the number of points that were left out because they are not finite.
template <class IsWanted>
std::uint64_t score_scan(const LocalMap& map, const ScanView& scan, const std::uint8_t* truth,
                         double max_range_m, IsWanted&& is_wanted, Scores& scores) {
  const int unlabelled = map.classes().unlabelled();
  // Any number that is not a class.
  const auto label_of = [unlabelled](int component) {
    return component < unlabelled ? component : 0;
  };
  std::uint64_t non_finite = 0;
  for (std::size_t i = 0; i < scan.count; ++i) {
    if (label_of(truth[i]) == 0) continue;
    const float* const p_sensor = scan.points + i * scan.stride_floats;
    const double square = static_cast<double>(p_sensor[0]) * static_cast<double>(p_sensor[0]) +
                          static_cast<double>(p_sensor[1]) * static_cast<double>(p_sensor[1]) +
                          static_cast<double>(p_sensor[2]) * static_cast<double>(p_sensor[2]);
    if (!std::isfinite(square)) {
      ++non_finite;
      continue;
    }
    if (max_range_m > 0.0 && square > max_range_m * max_range_m) continue;
    const Point3f p_map = transform(scan.T_map_sensor, p_sensor);
    if (!is_wanted(p_map)) continue;
    const int input = scan.components == nullptr ? 0 : label_of(scan.components[i]);
    scores.add(truth[i], map.evidence(p_map), map.reading(), input);
  }
  return non_finite;
}

}  // namespace tessera
