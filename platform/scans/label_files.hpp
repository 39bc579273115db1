// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The labels of a scan in a file of their own, in the KITTI layout: NNNNNN.label with one for each
// point, or NNNNNN.topk with several and their weights. Both are 32-bit words, whose lower 16 bits
// are a raw id; the upper ones are an instance that is not read in the first kind, and a weight in
// 255ths of the point's in the second, which has the labels of a point one after the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "base/outcome.hpp"
#include "scans/dataset_classes.hpp"
#include "scans/scan.hpp"

namespace tessera {

/// The labels of one scan.
struct LabelFile {
  std::string_view dataset;
  std::string_view folder;
  int scan_number = 0;
  std::size_t points = 0;
};

/// The suffix of files with weights, which are read where a scan has both kinds.
inline constexpr const char* kWeightedSuffix = ".topk";

/// Checks the size of the file. Returns how many labels with weights each point has, 1 where there
/// are no points; 0: one without one. Fails with kUsage iff the scan has no such file, or one with
/// another number of points or with more than kMostLabels for each.
Outcome<std::size_t> check_label_file(const LabelFile& file);

/// Where to read labels to: components and weights of weighted_labels each for every point; weights
/// empty: the best of each point alone, as PointLabeller has it.
struct LabelRoom {
  std::span<std::uint8_t> components;
  std::span<std::uint8_t> weights{};
  std::size_t weighted_labels = 0;  ///< As check_label_file() returned.
};
/// Reads a checked file. No heap unless it fails: with kFailure iff it can no longer be read or has
/// changed its size, with kUsage iff a single label's weight is above 255.
Outcome<UnknownRawIds> read_label_file(const LabelFile& file, const DatasetClasses& classes,
                                       const LabelRoom& room);
/// The best labels of a file that was checked, of either kind. Fails as read_label_file().
Outcome<UnknownRawIds> read_best_labels(const LabelFile& file, const DatasetClasses& classes,
                                        std::span<std::uint8_t> components);

}  // namespace tessera
