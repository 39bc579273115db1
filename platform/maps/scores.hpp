// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The measures of "eval": IoU, coverage, accuracy, calibration.
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

class Scores {
 public:
  /// Adds a point with labelled truth: the map's estimate of its voxel, and the given label (0:
  /// unlabelled).
  void add(int truth, const Estimate& estimate, int input);
  [[nodiscard]] std::uint64_t points() const { return points_; }
  [[nodiscard]] const Confusion& map() const { return map_; }
  [[nodiscard]] const Confusion& input() const { return input_; }
  [[nodiscard]] double coverage() const { return share(covered_); }
  [[nodiscard]] double coverage_any() const { return share(occupied_); }
  [[nodiscard]] double accuracy() const { return share(correct_); }
  /// Expected calibration error over 15 equal bins of the label's probability, covered points.
  [[nodiscard]] double calibration_error() const;
  /// has_input: if false, values of the input are null.
  [[nodiscard]] Json json(const ClassTable& classes, bool has_input) const;

 private:
  static constexpr std::size_t kBins = 15;
  struct Bin {
    std::uint64_t points = 0;
    std::uint64_t correct = 0;
    double probability = 0.0;
  };
  [[nodiscard]] double share(std::uint64_t count) const {
    return points_ == 0 ? 0.0 : static_cast<double>(count) / static_cast<double>(points_);
  }
  Confusion map_;
  Confusion input_;
  std::array<Bin, kBins> bins_{};
  std::uint64_t points_ = 0;
  std::uint64_t occupied_ = 0;
  std::uint64_t covered_ = 0;
  std::uint64_t correct_ = 0;
};

/// What was left out, and what makes the scores worth little: no point, a map without labels,
/// points of which most are not in it. non_finite: as score_scan returned, of all scans.
[[nodiscard]] std::vector<Message> doubts_of(const Scores& scores, const LocalMap& map,
                                             std::uint64_t non_finite);

}  // namespace tessera
