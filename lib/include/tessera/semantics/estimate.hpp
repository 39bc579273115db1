// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a voxel's counts say: paper eqs. 8 and 17 on the counts as they are, or on what they are
// worth (reading.hpp); occupancy and state as the specification defines them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/semantics/evidence.hpp"
#include "tessera/semantics/reading.hpp"

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
  double probability = 0.0;  ///< Of the label; 0 without one.
  double variance = 0.0;     ///< Of that probability; 0 without a label.
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
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): what lies beyond size_ is never read
  constexpr CountSummary(int num_components, float free) noexcept
      : num_components_(num_components), free_(static_cast<double>(free)), total_(free_) {
    counts_[0] = free;
    components_[0] = 0;
  }
  /// component in 1 .. C + 1, higher with every call.
  constexpr void add(int component, float count) noexcept {
    total_ += static_cast<double>(count);
    if (count > 0.0F) {
      counts_[size_] = count;
      components_[size_++] = static_cast<std::uint8_t>(component);
    }
    if (count > most_ && component + 1 < num_components_) {
      most_ = count;
      label_ = component;
      label_at_ = size_ - 1;
    }
  }
  /// The label so far; 0 if none.
  [[nodiscard]] constexpr int label() const noexcept { return label_; }
  constexpr void add_rest(float rest) noexcept {
    total_ += static_cast<double>(rest);
    rest_ = rest;
  }

  /// State, label and certainty by the counts as they are. prior: sigma_0 of every component, >= 0.
  /// O(1).
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
  /// The same with the probability of what the counts are worth, and its variance. O(components
  /// with evidence).
  [[nodiscard]] Estimate estimate(const Reading& reading) const noexcept {
    Estimate result = estimate(reading.prior());
    if (result.label == 0 || !reading.is_effective()) return result;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before they are read
    std::array<double, kMaxComponents> weights;
    const double number = effective_number(reading);
    const double sum = weigh(reading, number, weights);
    result.probability = (reading.prior_weight() + weights[label_at_]) / sum;
    const double concentration = num_components_ * reading.prior() + number;
    result.variance =
        result.probability * (1.0 - result.probability) / (concentration + 1.0);  // eq. (17)
    return result;
  }
  /// The probability of each component, 0 .. C + 1; what is left of 1 is evidence whose class is
  /// not known any more. into: num_components. O(components).
  void distribution(const Reading& reading, std::span<double> into) const noexcept {
    const double concentration = num_components_ * reading.prior() + total_;
    const bool is_effective = reading.is_effective() && total_ > 0.0;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): written before they are read
    std::array<double, kMaxComponents> weights;
    const double sum =
        is_effective ? weigh(reading, effective_number(reading), weights) : concentration;
    const double unseen = is_effective ? reading.prior_weight() : reading.prior();
    for (double& probability : into) probability = sum > 0.0 ? unseen / sum : 0.0;
    for (std::size_t i = 0; i < size_ && sum > 0.0; ++i)
      into[components_[i]] =
          (unseen + (is_effective ? weights[i] : static_cast<double>(counts_[i]))) / sum;
  }

 private:
  /// Of all counts.
  [[nodiscard]] double effective_number(const Reading& reading) const noexcept {
    return reading.effective_number(label_ != 0 ? total_ + reading.around() : total_);
  }
  /// weights: of each that was added. Returns their sum, with that of the rest and of all that was
  /// not observed. number: the effective one of all counts.
  double weigh(const Reading& reading, double number,
               std::array<double, kMaxComponents>& weights) const noexcept {
    const double worth = number / total_;
    const auto weight_of = [worth](float count, double of_class) {
      return Reading::weight_of(static_cast<double>(count) * worth * of_class);
    };
    double sum = num_components_ * reading.prior_weight();
    for (std::size_t i = 0; i < size_; ++i) {
      weights[i] = weight_of(counts_[i], reading.worth(components_[i]));
      sum += weights[i];
    }
    return rest_ > 0.0F ? sum + weight_of(rest_, Reading::kNoClass) : sum;
  }

  int num_components_;
  int label_ = 0;
  float most_ = 0.0F;
  float rest_ = 0.0F;
  double free_;
  double total_;
  // Of the components with evidence, the first one free space; what lies beyond is not set.
  std::size_t size_ = 1;
  std::size_t label_at_ = 0;  ///< Of the label.
  std::array<float, kMaxComponents> counts_;
  std::array<std::uint8_t, kMaxComponents> components_;
};

/// All of a voxel's counts.
[[nodiscard]] inline CountSummary summary_of(const VoxelEvidence& evidence) noexcept {
  CountSummary summary(evidence.num_components, evidence.sigma[0]);
  for (int l = 1; l < evidence.num_components; ++l)
    summary.add(l, evidence.sigma[static_cast<std::size_t>(l)]);
  summary.add_rest(evidence.rest);
  return summary;
}

/// State, label and certainty of one voxel by the counts as they are. prior: sigma_0 of every
/// component, >= 0. O(C), no memory.
[[nodiscard]] inline Estimate estimate(const VoxelEvidence& evidence, double prior) noexcept {
  return summary_of(evidence).estimate(prior);
}

/// The same as a map is read: with the probability of what the counts are worth.
[[nodiscard]] inline Estimate estimate(const VoxelEvidence& evidence,
                                       const Reading& reading) noexcept {
  return summary_of(evidence).estimate(reading);
}

}  // namespace tessera
