// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a voxel's counts say: paper eqs. 8 and 17, occupancy and state as the specification defines
// them.
#pragma once

#include <cstdint>

#include "tessera/semantics/evidence.hpp"

namespace tessera {

enum class VoxelState : std::uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2 };

/// "unknown", "free" or "occupied".
constexpr const char* to_string(VoxelState state) noexcept {
  switch (state) {
    case VoxelState::kUnknown:
      return "unknown";
    case VoxelState::kFree:
      return "free";
    case VoxelState::kOccupied:
      return "occupied";
  }
  return "invalid";
}

struct Estimate {
  VoxelState state = VoxelState::kUnknown;
  int label = 0;  ///< Class 1 .. C with the most evidence, ties to the lowest; 0 if none has any.
  double probability = 0.0;  ///< lambda of the label, eq. 8; 0 without a label.
  double variance = 0.0;     ///< V of the label, eq. 17; 0 without a label.
  double evidence = 0.0;     ///< Sum of the counts, without the prior.
  double occupancy = 0.0;    ///< 1 - lambda_0, eq. 8, whatever the state.
};

/// The optional threshold on the label's variance: true iff there is a label and it is less certain
/// than that.
[[nodiscard]] constexpr bool is_uncertain(const Estimate& estimate, double max_variance) noexcept {
  return estimate.label != 0 && estimate.variance > max_variance;
}

/// lambda_l = (prior + sigma_l) / sum over l' of (prior + sigma_l'). component in [0, C + 2). O(C).
[[nodiscard]] inline double probability_of(const VoxelEvidence& evidence, int component,
                                           double prior) noexcept {
  const double concentration = evidence.num_components * prior + evidence.total();
  const double count =
      prior + static_cast<double>(evidence.sigma[static_cast<std::size_t>(component)]);
  return concentration > 0.0 ? count / concentration : 0.0;  // eq. (8)
}

/// State, label and certainty of one voxel. prior: sigma_0 of every component, >= 0. O(C), no
/// memory.
[[nodiscard]] inline Estimate estimate(const VoxelEvidence& evidence, double prior) noexcept {
  Estimate result;
  result.evidence = evidence.total();
  const double concentration = evidence.num_components * prior + result.evidence;
  result.occupancy = concentration > 0.0 ? 1.0 - probability_of(evidence, 0, prior) : 0.0;
  if (!(result.evidence > 0.0)) return result;
  result.state = result.occupancy > 0.5 ? VoxelState::kOccupied : VoxelState::kFree;
  float most = 0.0F;
  for (int label = 1; label + 1 < evidence.num_components; ++label) {
    const float count = evidence.sigma[static_cast<std::size_t>(label)];
    if (count > most) {
      most = count;
      result.label = label;
    }
  }
  if (result.label == 0) return result;
  result.probability = probability_of(evidence, result.label, prior);
  result.variance =
      result.probability * (1.0 - result.probability) / (concentration + 1.0);  // eq. (17)
  return result;
}

}  // namespace tessera
