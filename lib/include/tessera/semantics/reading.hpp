// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How far counts can be relied on: what a count is worth as evidence of its class, and the
// probabilities that follow from it. docs/design/theory.md, Probabilities.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// What probabilities of labels are of.
enum class Probabilities : std::uint8_t {
  kEffective = 0,  ///< Of what the counts are worth. Learned on maps of kernels and of votes.
  kShares = 1      ///< Eq. 8 on the counts as they are, as the paper has it.
};

/// "effective" or "shares".
constexpr const char* to_string(Probabilities of) noexcept {
  return of == Probabilities::kShares ? "shares" : "effective";
}

/// How maps of a prior, a resolution and a class table are read. Counts of one voxel are
/// correlated: scans of one sensor from nearly the same place repeat each other's errors. So n
/// counts are worth fewer independent observations, and some classes are taken for others more
/// often than the rest.
class Reading {
 public:
  /// What an effective observation is worth, how fast further ones are worth less, and how much
  /// each unit of the prior weighs. Learned on streets and real scans (docs/measured/choices.md,
  /// Probabilities).
  static constexpr double kGain = 4.2;
  static constexpr double kCorrelation = 0.28;
  static constexpr double kPriorWeight = 78.0;
  /// Counts that what was said around a voxel is worth, where its label follows that
  /// (MapConfig::label_votes).
  static constexpr double kAround = 0.9;
  /// Worth of an observation of a class, by its name: whose surfaces are large and like no others;
  /// all else; what is thin, or much like something more frequent.
  static constexpr double kPlain = 1.0;
  static constexpr double kUsual = 0.75;
  static constexpr double kDoubtful = 0.375;
  /// Of evidence of no class: what is unlabelled, and the rest, which is of many. It is no answer
  /// that a label has to beat.
  static constexpr double kNoClass = 0.125;

  /// Shares of the counts, without a prior.
  constexpr Reading() noexcept = default;
  /// Without a prior probabilities are shares, whatever they are to be of.
  constexpr Reading(Probabilities of, double prior, double resolution_m, const ClassTable& classes,
                    bool label_votes = false) noexcept
      : prior_(prior),
        around_(label_votes ? kAround : 0.0),
        density_(kDensityLength_m / resolution_m),
        effective_(of == Probabilities::kEffective && prior > 0.0),
        no_class_(std::uint64_t{1} << static_cast<unsigned>(classes.unlabelled())) {
    for (int label = 1; label <= classes.num_classes(); ++label) {
      const double worth = worth_by_name(classes[label].name_view());
      const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(label);
      if (worth == kPlain) plain_ |= bit;
      if (worth == kDoubtful) doubtful_ |= bit;
    }
  }

  /// sigma_0 of every component.
  [[nodiscard]] constexpr double prior() const noexcept { return prior_; }
  /// Whether probabilities are those of effective observations; else they are eq. 8 on the counts.
  [[nodiscard]] constexpr bool is_effective() const noexcept { return effective_; }
  /// kPlain, kUsual or kDoubtful. Names of common data sets.
  [[nodiscard]] static constexpr double worth_by_name(std::string_view name) noexcept {
    constexpr std::array<std::string_view, 3> kPlainNames{"car", "road", "street"};
    constexpr std::array<std::string_view, 8> kDoubtfulNames{
        "other-ground",  "other-vehicle", "pole",  "post",
        "traffic-light", "traffic-sign",  "truck", "trunk"};
    if (detail::is_one_of(name, kPlainNames)) return kPlain;
    return detail::is_one_of(name, kDoubtfulNames) ? kDoubtful : kUsual;
  }
  /// Of a component 0 .. C + 1.
  [[nodiscard]] constexpr double worth(int component) const noexcept {
    const std::uint64_t bit = std::uint64_t{1} << static_cast<unsigned>(component);
    return (plain_ & bit) != 0 || component == 0 ? kPlain
           : (doubtful_ & bit) != 0              ? kDoubtful
           : (no_class_ & bit) != 0              ? kNoClass
                                                 : kUsual;
  }

  /// kAround, or 0 of a map without votes. It adds to the counts of voxels with a label.
  [[nodiscard]] constexpr double around() const noexcept { return around_; }
  /// N, the effective number of observations that a sum of counts amounts to.
  [[nodiscard]] double effective_number(double total) const noexcept {
    const double root = std::sqrt(total * density_);
    const double independent = root * std::sqrt(root);  // to the power of 3/4
    return kGain * independent / (1.0 + kCorrelation * independent);
  }
  /// What a component weighs without evidence.
  [[nodiscard]] constexpr double prior_weight() const noexcept { return kPriorWeight * prior_; }
  /// What so many effective observations of a component add to that: nearly e^n - 1, as each
  /// multiplies odds by e. n >= 0.
  [[nodiscard]] static constexpr double weight_of(double n) noexcept {
    double factor = 1.0 + n / 8.0;
    for (int i = 0; i < 3; ++i) factor *= factor;
    return factor - 1.0;
  }

 private:
  static constexpr double kDensityLength_m = 0.1;

  double prior_ = 0.0;
  double around_ = 0.0;
  double density_ = 1.0;
  bool effective_ = false;
  std::uint64_t no_class_ = 0;
  std::uint64_t plain_ = 0;
  std::uint64_t doubtful_ = 0;
};

}  // namespace tessera
