// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A recorded sequence in the folder layout of KITTI odometry and SemanticKITTI:
// velodyne/NNNNNN.bin, <labels>/NNNNNN.label, poses.txt, calib.txt, classes.toml; and, beyond that
// layout, times/NNNNNN.bin (a float32 per point, seconds from the scan's stamp), times.txt,
// poses_dense.txt, cameras.toml and the cameras' NNNNNN.png of class numbers. open() checks by
// names and sizes alone that everything exists and matches; read() then reads one scan at a time
// into memory that is allocated once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"
#include "scans/dataset_classes.hpp"
#include "scans/label_files.hpp"
#include "scans/recorded_scans.hpp"
#include "scans/scan_listing.hpp"
#include "settings/source_options.hpp"

namespace tessera {

/// Whether scans with times of their points are corrected for the robot's motion.
enum class Deskewing : std::uint8_t {
  kWhereTimed,  ///< If the dataset has a folder times.
  kOn,          ///< Refuses a dataset without it.
  kOff,
};

/// As a user chose; nothing: kWhereTimed.
[[nodiscard]] Deskewing deskewing(std::optional<bool> on) noexcept;

struct DatasetOptions {
  std::optional<int> first;  ///< Scan number; by default the lowest.
  std::optional<int> last;   ///< Inclusive; by default the highest.
  /// Folder of labels to use, kCameraLabels or kNoLabels.
  std::string labels = "predictions";
  Deskewing deskew = Deskewing::kWhereTimed;
  /// Also the robot's motion, if the dataset has it and correcting motion does not need it.
  bool with_motion = false;
  /// Also the times of points, if the dataset has them and scans are not deskewed: for those who
  /// pass scans on as measured, as a Registrar corrects what has times.
  bool with_times = false;
  /// Also the label images of its cameras, if it has any.
  bool with_images = false;
};

class Dataset final : public RecordedScans {
 public:
  /// Fails with kUsage, naming the file and the remedy, iff: a folder (dir, velodyne, the labels)
  /// or poses.txt is missing; there are no scans in the range; poses.txt has no row for a scan; a
  /// .bin is not a multiple of 16 bytes or has more than 2^24 points; a label file is missing or
  /// has another number of points; poses.txt, calib.txt or classes.toml are malformed; if scans
  /// are deskewed, a file of times is missing or has another number of points, or ScanMotion::load
  /// fails; if images are read, open_cameras() fails or an image is missing; if the labels are from
  /// cameras, ScanMotion::load fails and is needed. Scans may be empty.
  static Outcome<Dataset> open(const std::string& dir, const DatasetOptions& options = {});

  [[nodiscard]] std::size_t num_scans() const noexcept override { return scans_.size(); }
  [[nodiscard]] int scan_number(std::size_t i) const override { return scans_[i].number; }
  [[nodiscard]] std::size_t num_points(std::size_t i) const override { return scans_[i].points; }
  [[nodiscard]] std::size_t max_points() const noexcept override { return max_points_; }
  [[nodiscard]] const DatasetClasses& classes() const noexcept override { return classes_; }
  [[nodiscard]] bool decodes() const noexcept override { return !cameras_.empty(); }
  [[nodiscard]] RegistrarConfig registration() const override;
  /// True if scans have labels from a folder.
  [[nodiscard]] bool has_labels() const noexcept {
    return labels_ != kNoLabels && labels_ != kCameraLabels;
  }
  /// Labels that each point has with weights, at most kMostLabels; 0: one without.
  [[nodiscard]] std::size_t weighted_labels() const noexcept { return weighted_labels_; }
  [[nodiscard]] bool deskews() const noexcept { return deskews_; }
  [[nodiscard]] const Matrix34d& T_map_sensor(std::size_t i) const override {
    return scans_[i].T_map_sensor;
  }
  /// Null unless scans are deskewed, cameras have offsets, or DatasetOptions::with_motion.
  [[nodiscard]] const ScanMotion* motion() const noexcept override {
    return motion_ ? &*motion_ : nullptr;
  }
  [[nodiscard]] bool has_times() const noexcept override { return has_times_; }
  /// Empty unless the labels are from cameras, or DatasetOptions::with_images.
  [[nodiscard]] const std::vector<CameraDescription>& cameras() const noexcept { return cameras_; }
  /// Runs of numbers within the chosen range that have no scan, for a warning (to_text()).
  [[nodiscard]] const std::vector<ScanRange>& missing() const noexcept { return missing_; }

  /// Does not use the heap if the scan holds max_points() and nothing fails, except for decoding
  /// the cameras' images. Fails with kFailure iff a file can no longer be read or has changed its
  /// size since open(), with kUsage iff read_images() does.
  Outcome<void> read(std::size_t i, Scan& into) const override;

  /// Checks another folder of labels, for example ground truth, as open() does. Fails with kUsage.
  Outcome<void> check_labels(const std::string& folder) const;
  /// Reads the labels of scan i from that folder as components, the heaviest where a point has
  /// several, and C + 1 where none has a weight; out.size() must be num_points(i).
  /// No heap unless it fails, as read() does.
  Outcome<UnknownRawIds> read_labels(std::size_t i, std::string_view folder,
                                     std::span<std::uint8_t> out) const {
    return read_labels(i, folder, classes_, out);
  }
  /// The same, by other classes of the same table.
  Outcome<UnknownRawIds> read_labels(std::size_t i, std::string_view folder,
                                     const DatasetClasses& classes,
                                     std::span<std::uint8_t> out) const;

 private:
  struct Entry {
    int number = 0;
    std::size_t points = 0;
    Matrix34d T_map_sensor = Matrix34d::Identity();
  };

  Dataset(std::string dir, DatasetClasses classes, std::string labels);
  Outcome<void> choose_scans(const DatasetOptions& options);
  Outcome<void> measure_scans();
  Outcome<void> attach_poses();
  Outcome<void> check_times();
  Outcome<void> check_cameras();
  Outcome<void> read_file(std::size_t i, std::string_view folder, std::span<float> out) const;
  Outcome<void> read_components(std::size_t i, Scan& scan) const;
  [[nodiscard]] LabelFile label_file(std::size_t i, std::string_view folder) const noexcept {
    return {dir_, folder, scans_[i].number, scans_[i].points};
  }
  /// Returns as weighted_labels().
  Outcome<std::size_t> check_label_files(const std::string& folder, const Message& remedy) const;

  std::string dir_;
  DatasetClasses classes_;
  std::string labels_;
  bool deskews_ = false;
  bool has_times_ = false;     ///< Files of times, which are read.
  bool wants_motion_ = false;  ///< If the dataset has any.
  std::optional<ScanMotion> motion_;
  std::vector<CameraDescription> cameras_;
  std::vector<Entry> scans_;
  std::vector<ScanRange> missing_;
  std::size_t max_points_ = 0;
  std::size_t weighted_labels_ = 0;
};

}  // namespace tessera
