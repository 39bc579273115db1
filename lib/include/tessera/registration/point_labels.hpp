// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels with weights: what a network thinks a point to be, as the few classes that it thinks most
// likely and how likely each is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "tessera/base/status.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

/// The probabilities of a point's labels as weights in 255ths, so rounded that their sum is the
/// rounded sum of the probabilities. Fails with kInvalidArgument iff a probability is negative or
/// not finite, their sum is above 1 + kMostExcess (what is above 1 is taken for rounding), there
/// are more than kMostLabels, or weights is not as long; weights are all 0 then. O(kMostLabels^2).
[[nodiscard]] Status quantise_label_weights(std::span<const float> probabilities,
                                            std::span<std::uint8_t> weights) noexcept;
/// Of a sum of probabilities, over one: half precision rounds about as much.
inline constexpr float kMostExcess = 2e-3F;

/// What labels a point of a scan has.
enum class Labelling : std::uint8_t {
  kLabelled,
  kUnlabelled,  ///< None that is a class has a weight.
  kWrong,       ///< Their weights sum to more than one, or are missing: as unlabelled.
};
/// Gives points of a scan their labels. The scan's arrays must outlive it.
class PointLabeller {
 public:
  /// unlabelled: the component C + 1. O(1), 256 steps.
  PointLabeller(const ScanView& scan, std::uint8_t unlabelled) noexcept;

  /// Gives point the labels of number i, the best first (equals in their order); what their weights
  /// leave of one goes to unlabelled. point: without labels. O(kMostLabels^2).
  [[nodiscard]] Labelling label(std::size_t i, ScanPoint& point) const noexcept {
    if (kind_ == Kind::kPlain) {
      const std::uint8_t label = class_of_[components_[i]];
      point.component = label != 0 ? label : unlabelled_;
      return label != 0 ? Labelling::kLabelled : Labelling::kUnlabelled;
    }
    if (kind_ == Kind::kWeighted) return label_weighted(i, point);
    return without_label(point, kind_ == Kind::kNone ? Labelling::kUnlabelled : Labelling::kWrong);
  }
  /// Whether labels have weights.
  [[nodiscard]] bool weighted() const noexcept { return kind_ == Kind::kWeighted; }
  /// Of labels with weights: the best one alone, as label() has it; point.has_one_label() is as
  /// after label(), and nothing else of its labels is of use. O(1) where more than half of the
  /// weight is on the first, as networks mostly give it.
  [[nodiscard]] Labelling label_best(std::size_t i, ScanPoint& point) const noexcept {
    const std::uint8_t* const components = components_ + i * labels_;
    const std::uint8_t* const weights = weights_ + i * labels_;
    static_assert(kMostLabels == 3);
    const unsigned second = labels_ > 1 ? weights[1] : 0U;
    const unsigned third = labels_ > 2 ? weights[2] : 0U;
    const std::uint8_t first = class_of_[components[0]];
    // A class that is named twice may have all of the weight.
    const bool again =
        (second != 0 && components[1] == first) || (third != 0 && components[2] == first);
    if (first == 0 || weights[0] <= second + third || weights[0] + second + third > kOneLabel ||
        again)
      return label_weighted(i, point);
    point.component = first;
    point.label_weights = weights[0];
    return Labelling::kLabelled;
  }

 private:
  enum class Kind : std::uint8_t { kNone, kPlain, kWeighted, kWrong };

  Labelling without_label(ScanPoint& point, Labelling why) const noexcept {
    point.component = unlabelled_;
    point.label_weights = kOneLabel;
    return why;
  }
  [[nodiscard]] Labelling label_weighted(std::size_t i, ScanPoint& point) const noexcept;

  const std::uint8_t* components_;
  const std::uint8_t* weights_;
  std::size_t labels_;
  std::array<std::uint8_t, 256> class_of_{};  ///< Of a component; 0: it is no class.
  std::uint8_t unlabelled_;
  Kind kind_ = Kind::kNone;
};

}  // namespace tessera
