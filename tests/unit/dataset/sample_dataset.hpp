// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A small dataset in a folder of its own, complete and right, for tests to break one thing in.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "support/temporary_folder.hpp"

namespace tessera::test {

inline constexpr const char* kIdentityRow = "1 0 0 0 0 1 0 0 0 0 1 0\n";

class SampleDataset {
 public:
  /// Scans 0 .. num_scans - 1; scan n has n + 1 points, all labelled 40 (road) in predictions and
  /// 70 (vegetation) in labels; identity poses; no calibration.
  explicit SampleDataset(int num_scans = 3);

  [[nodiscard]] std::string dir() const { return folder_.path().string(); }
  [[nodiscard]] const TemporaryFolder& folder() const { return folder_; }
  void write_points(int scan, const std::vector<float>& points_xyzi) const;
  void write_labels(const std::string& folder, int scan, const std::vector<std::uint32_t>&) const;
  void write_weighted_labels(const std::string& folder, int scan,
                             const std::vector<std::uint32_t>&) const;
  void remove(const std::string& name) const;

 private:
  TemporaryFolder folder_;
};

[[nodiscard]] std::string scan_name(const std::string& folder, int scan, const char* extension);

}  // namespace tessera::test
