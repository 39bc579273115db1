// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Text for what was left out and where, short enough for one line: the first few of many.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "scans/dataset.hpp"

namespace tessera {

/// Counts numbers and keeps the first few.
class NumberList {
 public:
  static constexpr std::size_t kShown = 8;
  void add(int number);
  [[nodiscard]] std::size_t count() const { return count_; }
  /// "3, 7, 8", with ", ..." if there are more.
  [[nodiscard]] std::string text() const;

 private:
  std::array<int, kShown> first_{};
  std::size_t count_ = 0;
};

/// "2 scans left out, with a pose that is not a rigid transform: 3, 7".
[[nodiscard]] std::string text_of_bad_poses(const NumberList& scans);

/// Class ids of several scans that are in no class.
class UnknownIdCount {
 public:
  /// folder: where the labels are, for the text; empty: not named.
  explicit UnknownIdCount(std::string folder = {}) : folder_(std::move(folder)) {}
  void add(int scan, const UnknownRawIds& ids);
  [[nodiscard]] std::uint64_t points() const { return all_.points; }
  /// "4 points of labels with class ids ... (7, 300), first in scan 2; taken as unlabelled".
  [[nodiscard]] std::string text() const;

 private:
  std::string folder_;
  int first_scan_ = 0;
  UnknownRawIds all_;
};

}  // namespace tessera
