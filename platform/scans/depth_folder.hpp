// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Scans of a depth camera: a folder of depth images, optionally one of label images, the file of
// the camera, and a file with a pose for each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "scans/cameras_toml.hpp"
#include "scans/posed_files.hpp"
#include "scans/recorded_scans.hpp"

namespace tessera {

struct DepthOptions {
  std::string label_images;  ///< Folder of images with the names of the depth images; empty: none.
  std::string intrinsics;    ///< File for read_depth_camera().
  std::string poses;  ///< File for read_pose_rows(), a row for each depth image: T_map_camera,
                      ///< camera x right, y down, z forward.
  std::optional<int> first;  ///< Scan number: the images in their order, from 0.
  std::optional<int> last;   ///< Inclusive.
  bool with_motion = false;  ///< Also motion(), if the poses have stamps.
};

/// Scans of depth in metres, and of the labels of their pixels.
class DepthFolder final : public RecordedScans {
 public:
  /// Fails with kUsage, naming the file and the remedy, iff list_by_number() of .png,
  /// DatasetClasses::load(), read_depth_camera() or read_pose_rows() does, there are more or fewer
  /// poses than depth images, there is no image in the range, a label image is missing, or the
  /// camera has over 2^24 pixels.
  static Outcome<DepthFolder> open(const std::string& folder, const DepthOptions& options);

  [[nodiscard]] std::size_t num_scans() const noexcept override { return scans_.size(); }
  [[nodiscard]] int scan_number(std::size_t i) const override { return scans_[i].file.number; }
  [[nodiscard]] std::size_t num_points(std::size_t /*i*/) const override { return max_points(); }
  /// Sampled pixels of an image.
  [[nodiscard]] std::size_t max_points() const noexcept override;
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
  /// Fails as read_grey_png(). Counts label ids in no class among the sampled pixels. Uses the
  /// heap.
  Outcome<void> read(std::size_t i, Scan& into) const override;

  /// All files, chosen or not.
  [[nodiscard]] std::size_t num_files() const noexcept { return num_files_; }
  [[nodiscard]] std::size_t num_poses() const noexcept { return num_poses_; }

 private:
  struct Entry {
    PosedFile file;
    std::string label_path;  ///< Empty: none.
  };
  explicit DepthFolder(DatasetClasses classes) : classes_(std::move(classes)) {}
  Outcome<void> choose(const std::string& folder, const DepthOptions& options);
  Outcome<void> find_labels(const std::string& folder);
  Outcome<void> read_camera(const DepthOptions& options);
  [[nodiscard]] std::size_t num_pixels() const noexcept;
  [[nodiscard]] ScanLimits limits() const noexcept;
  Outcome<void> read_labels(const Entry& entry, Scan& into) const;

  DatasetClasses classes_;
  std::vector<Entry> scans_;
  DepthCameraDescription camera_;
  std::optional<ScanMotion> motion_;
  std::size_t num_files_ = 0;
  std::size_t num_poses_ = 0;
  bool has_labels_ = false;
  mutable std::vector<std::uint16_t> pixels_;  ///< Of the file that is read.
};

}  // namespace tessera
