// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Scans of a depth camera: a folder of depth images, optionally one of label images, the file of
// the camera, and a file with a pose for each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/outcome.hpp"
#include "scans/cameras_toml.hpp"
#include "scans/dataset.hpp"
#include "scans/dataset_classes.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

struct DepthOptions {
  std::string label_images;  ///< Folder of images with the names of the depth images; empty: none.
  std::string intrinsics;    ///< File for read_depth_camera().
  std::string poses;  ///< File for read_pose_rows(), a row for each depth image: T_map_camera,
                      ///< camera x right, y down, z forward.
  std::optional<int> first;  ///< Scan number: the images in their order, from 0.
  std::optional<int> last;   ///< Inclusive.
};

/// Sampled pixels become the points of a scan, by DepthCamera.
class DepthFolder final : public RecordedScans {
 public:
  /// Fails with kUsage, naming the file and the remedy, iff list_by_number() of .png,
  /// DatasetClasses::load(), read_depth_camera() or read_pose_rows() does, there are more or fewer
  /// poses than depth images, there is no image in the range, a label image is missing, or the
  /// camera has over 2^24 pixels.
  static Outcome<DepthFolder> open(const std::string& folder, const DepthOptions& options);

  [[nodiscard]] std::size_t num_scans() const noexcept override { return scans_.size(); }
  [[nodiscard]] std::size_t max_points() const noexcept override {
    return rig_->camera.most_points();
  }
  [[nodiscard]] const DatasetClasses& classes() const noexcept override { return classes_; }
  [[nodiscard]] bool decodes() const noexcept override { return true; }
  /// Fails as read_grey_png(). Counts label ids in no class among the sampled pixels. Uses the
  /// heap.
  Outcome<DatasetScan> read(std::size_t i, ScanBuffer& buffer) const override;

  /// All files, chosen or not.
  [[nodiscard]] std::size_t num_files() const noexcept { return num_files_; }

 private:
  struct Entry {
    int number = 0;
    std::string depth_path;
    std::string label_path;  ///< Empty: none.
    Matrix34d T_map_camera = Matrix34d::Identity();
  };
  /// The camera, and memory for its images.
  struct Rig {
    DepthCameraDescription description;
    DepthCamera camera;
    std::vector<std::uint16_t> pixels;
    std::vector<float> depth_m;
    std::vector<std::uint8_t> labels;
    std::vector<float> points;
    ArenaMemory memory;
  };

  explicit DepthFolder(DatasetClasses classes) : classes_(std::move(classes)) {}
  Outcome<void> choose(const std::string& folder, const DepthOptions& options);
  Outcome<void> find_labels(const std::string& folder);
  Outcome<void> make_rig(const DepthOptions& options);
  Outcome<UnknownRawIds> read_labels(const Entry& entry) const;

  DatasetClasses classes_;
  std::vector<Entry> scans_;
  std::unique_ptr<Rig> rig_;
  std::size_t num_files_ = 0;
};

}  // namespace tessera
