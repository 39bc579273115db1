// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writes scans of any source as a dataset in the KITTI layout, which maps to the same bytes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "scans/dataset_classes.hpp"
#include "scans/scan.hpp"
#include "scans/scan_motion.hpp"

namespace tessera {

class KittiWriter {
 public:
  /// The label folder that is written: the one that commands read by default.
  static constexpr const char* kLabelFolder = "predictions";

  /// Makes the folder with velodyne and predictions; and with times too, if with_times. Fails with
  /// kUsage iff it exists and is not an empty folder, cannot be made, or the classes leave no raw
  /// id for unlabelled points.
  static Outcome<KittiWriter> create(const std::string& folder, const DatasetClasses& classes,
                                     bool with_times);

  /// Writes the next scan, numbered from 0: its points and labels as the view has them, intensities
  /// where its stride has them, and with_times the times of scan's points. Fails with kFailure iff
  /// a file cannot be written, with kUsage iff there are more scans than names.
  Outcome<void> add(const Scan& scan, const ScanView& view);
  /// Writes a text file into the folder.
  Outcome<void> add_file(const std::string& name, std::string_view text);
  /// motion: null if the scans have no stamps. Writes times.txt and poses_dense.txt by it, and
  /// poses.txt last: a folder that has it has every scan. Numbers of poses have 17 significant
  /// digits. Fails with kFailure iff a file cannot be written.
  Outcome<void> finish(const ScanMotion* motion);

  [[nodiscard]] std::size_t num_scans() const noexcept { return stamps_us_.size(); }

 private:
  KittiWriter(std::string folder, bool with_times)
      : folder_(std::move(folder)), with_times_(with_times) {}
  Outcome<void> choose_raw_ids(const DatasetClasses& classes);
  Outcome<void> write_scan_file(const char* subfolder, const char* extension,
                                std::span<const std::byte> bytes);

  std::string folder_;
  bool with_times_;
  std::uint8_t unlabelled_ = 0;
  std::array<std::optional<std::uint16_t>, 256> raw_ids_{};  ///< Of each component.
  std::vector<float> points_xyzi_;
  std::vector<std::uint32_t> labels_;
  std::vector<std::int64_t> stamps_us_;
  std::string poses_;
};

}  // namespace tessera
