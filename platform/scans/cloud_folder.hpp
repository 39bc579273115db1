// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Scans from a folder of PCD or PLY files, and a file with a pose for each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"
#include "scans/cloud.hpp"
#include "scans/posed_files.hpp"
#include "scans/recorded_scans.hpp"

namespace tessera {

enum class CloudFormat : std::uint8_t { kPcd, kPly };

/// True if a comes before b with numbers in names compared as numbers: scan_9 before scan_10.
[[nodiscard]] bool is_before_by_number(std::string_view a, std::string_view b) noexcept;

/// The paths of the format's files in the folder, in that order; other names are ignored. Fails
/// with kUsage iff the folder is missing, unreadable or without such a file.
Outcome<std::vector<std::string>> list_clouds(const std::string& folder, CloudFormat format);

/// The same for any extension, for example ".png".
Outcome<std::vector<std::string>> list_by_number(const std::string& folder,
                                                 std::string_view extension);

struct CloudOptions {
  CloudFormat format = CloudFormat::kPcd;
  std::string poses;             ///< File for read_pose_rows(), a row for each cloud.
  std::optional<int> first;      ///< Scan number: the clouds in their order, from 0.
  std::optional<int> last;       ///< Inclusive.
  bool with_motion = false;      ///< Also motion(), if the poses have stamps.
  bool with_labels = true;       ///< If false, all points are unlabelled.
  bool with_no_returns = false;  ///< Keeps points of which the field no_return is not 0.
};

class CloudFolder final : public RecordedScans {
 public:
  /// Fails with kUsage, naming the file and the remedy, iff list_clouds(), DatasetClasses::load()
  /// read_pose_rows() or choose_files() does, or the header of a chosen one is refused by
  /// inspect_pcd() or inspect_ply().
  static Outcome<CloudFolder> open(const std::string& folder, const CloudOptions& options);

  [[nodiscard]] std::size_t num_scans() const noexcept override { return scans_.size(); }
  [[nodiscard]] int scan_number(std::size_t i) const override { return scans_[i].file.number; }
  [[nodiscard]] std::size_t num_points(std::size_t i) const override {
    return scans_[i].summary.points;
  }
  [[nodiscard]] std::size_t max_points() const noexcept override { return max_points_; }
  [[nodiscard]] const Matrix34d& T_map_sensor(std::size_t i) const override {
    return scans_[i].file.T_map_sensor;
  }
  [[nodiscard]] const DatasetClasses& classes() const noexcept override { return classes_; }
  /// By the stamps of the poses, if they have the form of TUM.
  [[nodiscard]] const ScanMotion* motion() const noexcept override {
    return motion_ ? &*motion_ : nullptr;
  }
  [[nodiscard]] bool decodes() const noexcept override { return true; }
  [[nodiscard]] RegistrarConfig registration() const override;
  /// Fails with kUsage as read_pcd() or read_ply(), with kFailure iff the file can no longer be
  /// read or its header has changed since open(). Uses the heap.
  Outcome<void> read(std::size_t i, Scan& into) const override;

  /// All files, chosen or not.
  [[nodiscard]] std::size_t num_files() const noexcept { return num_files_; }
  [[nodiscard]] std::size_t num_poses() const noexcept { return num_poses_; }
  /// Chosen scans with labels, and with a viewpoint other than the identity (which is ignored: the
  /// poses have the place of the sensor).
  [[nodiscard]] std::size_t num_labelled() const noexcept { return num_labelled_; }
  [[nodiscard]] std::size_t num_viewpoints() const noexcept { return num_viewpoints_; }

 private:
  struct Entry {
    PosedFile file;
    CloudSummary summary;
  };

  CloudFolder(CloudOptions options, DatasetClasses classes);
  Outcome<void> inspect();
  UnknownRawIds label(const Cloud& cloud, std::span<std::uint8_t> components) const;

  CloudOptions options_;
  DatasetClasses classes_;
  std::vector<Entry> scans_;
  std::optional<ScanMotion> motion_;
  std::size_t num_files_ = 0;
  std::size_t num_poses_ = 0;
  std::size_t max_points_ = 0;
  std::size_t num_labelled_ = 0;
  std::size_t num_viewpoints_ = 0;
};

}  // namespace tessera
