// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The measures of "eval": IoU, coverage, accuracy, and how far probabilities can be relied on.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/json.hpp"
#include "base/message.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/semantics/class_table.hpp"
#include "tessera/semantics/estimate.hpp"

namespace tessera {

/// Counts of one labelling against the truth. Labels are 0 (none) or 1 .. C.
class Confusion {
 public:
  void add(int truth, int label) {
    if (truth == label) {
      ++true_positive_[static_cast<std::size_t>(truth)];
      return;
    }
    ++false_negative_[static_cast<std::size_t>(truth)];
    if (label != 0) ++false_positive_[static_cast<std::size_t>(label)];
  }
  /// True iff the class occurs in the truth.
  [[nodiscard]] bool present(int label) const;
  /// TP / (TP + FP + FN); 0 if there are none.
  [[nodiscard]] double iou(int label) const;
  /// Mean over the classes present in the truth.
  [[nodiscard]] double mean_iou(int num_classes) const;
  /// The counts behind IoUs, for every class by name: those of several runs can be added.
  [[nodiscard]] Json counts(const ClassTable& classes) const;

 private:
  using Counts = std::array<std::uint64_t, kMaxComponents>;
  Counts true_positive_{};
  Counts false_positive_{};
  Counts false_negative_{};
};

/// How far the probabilities of labels can be relied on: of points in voxels with a label.
class Reliability {
 public:
  /// probability: of the label, in [0, 1]. square: sum over the components of the square of what
  /// their probability is off from the truth's, which is 1 for the true class and 0 for all else.
  void add(bool correct, double probability, double square);
  [[nodiscard]] std::uint64_t points() const { return points_; }
  /// Expected calibration error over 15 equal bins of the probability.
  [[nodiscard]] double calibration_error() const;
  /// Mean of the squares: 0 to 2 (Brier, Monthly Weather Review 78, 1950).
  [[nodiscard]] double brier_score() const;
  /// Area under the risk-coverage curve: the share of wrong labels among the n points with the most
  /// probable ones, its mean over n (Geifman and El-Yaniv, NIPS 2017). Probabilities that are
  /// equal to 12 bits are taken as equal, and such points as equally wrong. O(points).
  [[nodiscard]] double risk_coverage_area() const;
  /// All of this.
  [[nodiscard]] Json json() const;

 private:
  static constexpr std::size_t kBins = 15;
  static constexpr std::size_t kRanks = 4096;
  struct Bin {
    std::uint64_t points = 0;
    std::uint64_t correct = 0;
    double probability = 0.0;
  };
  struct Rank {
    std::uint64_t points = 0;
    std::uint64_t wrong = 0;
  };
  std::array<Bin, kBins> bins_{};
  std::vector<Rank> ranks_;  ///< By probability; none without a point.
  std::uint64_t points_ = 0;
  double squares_ = 0.0;
};

class Scores {
 public:
  /// Adds a point with labelled truth: what the map has in its voxel, and the given label (0:
  /// unlabelled). reading: the map's.
  void add(int truth, const VoxelEvidence& evidence, const Reading& reading, int input);
  [[nodiscard]] std::uint64_t points() const { return points_; }
  [[nodiscard]] const Confusion& map() const { return map_; }
  [[nodiscard]] const Confusion& input() const { return input_; }
  [[nodiscard]] double coverage() const { return share(reliability_.points()); }
  [[nodiscard]] double coverage_any() const { return share(occupied_); }
  [[nodiscard]] double accuracy() const { return share(correct_); }
  /// Of covered points.
  [[nodiscard]] const Reliability& reliability() const { return reliability_; }
  /// has_input: if false, values of the input are null.
  [[nodiscard]] Json json(const ClassTable& classes, bool has_input) const;

 private:
  [[nodiscard]] double share(std::uint64_t count) const {
    return points_ == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(points_);
  }
  Confusion map_;
  Confusion input_;
  Reliability reliability_;
  std::array<Reliability, kMaxComponents> by_label_;  ///< By what the map says.
  std::uint64_t points_ = 0;
  std::uint64_t occupied_ = 0;
  std::uint64_t correct_ = 0;
};

/// What was left out, and what makes the scores worth little: no point, a map without labels,
/// points of which most are not in it. non_finite: as score_scan returned, of all scans.
[[nodiscard]] std::vector<Message> doubts_of(const Scores& scores, const LocalMap& map,
                                             std::uint64_t non_finite);

}  // namespace tessera
