// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a voxel's counts say: paper eqs. 8 and 17, occupancy and state as the specification defines
// them.
#pragma once

#include <cstdint>

#include "tessera/semantics/evidence.hpp"

namespace tessera {

/// What a voxel is, by its evidence.
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

/// What an estimate needs of a voxel's counts, gathered in the order of components: free, labels
/// ascending, the rest. Leaving out components without evidence changes nothing, not even a last
/// bit.
class CountSummary {
 public:
  /// free: sigma_0.
  constexpr CountSummary(int num_components, float free) noexcept
      : num_components_(num_components), free_(static_cast<double>(free)), total_(free_) {}
  /// component in 1 .. C + 1, higher with every call.
  constexpr void add(int component, float count) noexcept {
    total_ += static_cast<double>(count);
    if (count > most_ && component + 1 < num_components_) {
      most_ = count;
      label_ = component;
    }
  }
  /// The label so far; 0 if none.
  [[nodiscard]] constexpr int label() const noexcept { return label_; }
  constexpr void add_rest(float rest) noexcept { total_ += static_cast<double>(rest); }

  /// State, label and certainty. prior: sigma_0 of every component, >= 0. O(1).
  [[nodiscard]] constexpr Estimate estimate(double prior) const noexcept {
    Estimate result;
    result.evidence = total_;
    const double concentration = num_components_ * prior + total_;
    if (concentration > 0.0) result.occupancy = 1.0 - (prior + free_) / concentration;  // eq. (8)
    if (!(total_ > 0.0)) return result;
    result.state = result.occupancy > 0.5 ? VoxelState::kOccupied : VoxelState::kFree;
    if (label_ == 0) return result;
    result.label = label_;
    result.probability = (prior + static_cast<double>(most_)) / concentration;  // eq. (8)
    result.variance =
        result.probability * (1.0 - result.probability) / (concentration + 1.0);  // eq. (17)
    return result;
  }

 private:
  int num_components_;
  int label_ = 0;
  float most_ = 0.0F;
  double free_;
  double total_;
};

/// State, label and certainty of one voxel. prior: sigma_0 of every component, >= 0. O(C), no
/// memory.
[[nodiscard]] inline Estimate estimate(const VoxelEvidence& evidence, double prior) noexcept {
  CountSummary summary(evidence.num_components, evidence.sigma[0]);
  for (int l = 1; l < evidence.num_components; ++l)
    summary.add(l, evidence.sigma[static_cast<std::size_t>(l)]);
  summary.add_rest(evidence.rest);
  return summary.estimate(prior);
}

}  // namespace tessera
