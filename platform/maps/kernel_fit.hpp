// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Kernels by class, fitted to data sets with true labels: those of a grid under which the labels of
// their octets have the largest mean IoU. One class after the other takes its best kernel, until
// none changes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "maps/kernel_samples.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

/// A kernel of the grid for each class, by its name.
struct KernelChoice {
  std::vector<std::string> names;
  std::vector<std::size_t> kernels;
};

struct FitData {
  KernelSamples samples;
  ClassTable classes;
  std::uint32_t folds = 0;
};

/// A part of the data: of one data set a fold alone, or all of them but for it.
struct FitPart {
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::size_t set = kNone;  ///< kNone: all of all data sets.
  std::uint32_t fold = 0;
  bool alone = false;
};

class KernelFit {
 public:
  /// A class takes another kernel only for more than this of the mean IoU.
  static constexpr double kLeastGain = 1e-4;
  static constexpr int kMostRounds = 6;

  /// data: of every set its votes are read; must outlive this.
  explicit KernelFit(const std::vector<FitData>& data);

  /// The kernels that the classes have in their tables, nearest in the grid.
  [[nodiscard]] KernelChoice of_tables() const;
  /// The same kernel for all classes.
  [[nodiscard]] KernelChoice of_one(const ClassKernel& kernel) const;
  /// Mean over the data sets of the mean IoU over the classes that are in their truth; those of
  /// which the part has no truth are left out. Nothing iff that is all.
  [[nodiscard]] std::optional<double> score(const KernelChoice& choice, const FitPart& part) const;
  /// The IoU of a class by name in all data sets that have it, their mean; negative: none has.
  [[nodiscard]] double iou(const KernelChoice& choice, std::string_view name) const;
  /// The best kernels on a part, which is not a fold alone, from those given on; classes that no
  /// truth of the part has keep theirs. O(kMostRounds classes kernels votes).
  [[nodiscard]] KernelChoice fit(KernelChoice start, const FitPart& part) const;
  /// From where a fit starts: this kernel, and of classes that no data set has in its truth those
  /// of their tables, as nothing can be learned of them.
  [[nodiscard]] KernelChoice start_of(const ClassKernel& kernel) const;

 private:
  using Counts = std::array<std::int64_t, kMaxComponents>;
  /// Of one data set, as far as a part has it.
  struct Labelling;

  [[nodiscard]] std::vector<Labelling> label_all(const KernelChoice& choice,
                                                 const FitPart& part) const;
  [[nodiscard]] static std::optional<double> mean_of(const std::vector<Labelling>& sets);

  const std::vector<FitData>& data_;
  std::vector<std::string> names_;
  /// Of each data set: the place of each class in names_.
  std::vector<std::vector<std::size_t>> places_;
  /// Of each data set, for each label the numbers of its votes.
  std::vector<std::array<std::vector<std::uint32_t>, kMaxComponents>> votes_of_;
};

}  // namespace tessera
