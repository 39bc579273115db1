// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels of a dataset's scans from its cameras' label images.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/outcome.hpp"
#include "scans/cameras_toml.hpp"
#include "scans/scan_motion.hpp"

namespace tessera {

/// A scan that is to be labelled.
struct ScanToLabel {
  int number = 0;
  PointsView points;
  const ScanMotion* motion = nullptr;  ///< Needed if a camera has an offset.
  int num_classes = 0;
};

class CameraLabels {
 public:
  /// Reads dir/cameras.toml. Fails with kUsage as read_cameras and iff the file is missing, a
  /// camera has no folder, or a mask is missing, damaged or of another size than the camera.
  static Outcome<std::unique_ptr<CameraLabels>> open(const std::string& dir);

  /// True if images are of other times than the scans.
  [[nodiscard]] bool needs_motion() const;
  /// Fails with kUsage iff an image of one of these scans is missing.
  Outcome<void> check_images(std::span<const int> scan_numbers) const;
  /// Reserves memory for scans of up to this number of points. Fails with kFailure iff there is
  /// none.
  Outcome<void> reserve(std::size_t max_points);
  /// Sets the components of the scan's points. A camera without a pose at its image's time is left
  /// out, with the status kOutOfRange. Fails with kUsage iff an image is missing, damaged or of
  /// another size than its camera. Uses the heap for decoding.
  Outcome<LabelReport> read(const ScanToLabel& scan, std::span<std::uint8_t> components);

  [[nodiscard]] const std::vector<CameraDescription>& cameras() const { return cameras_; }

 private:
  CameraLabels() = default;
  Outcome<void> read_mask(const CameraDescription& camera);

  std::string dir_;
  std::vector<CameraDescription> cameras_;
  std::vector<std::vector<std::uint8_t>> images_;
  std::vector<std::vector<std::uint8_t>> masks_;  ///< Empty for cameras without one.
  ArenaMemory memory_;
  LabelProjector projector_;
};

}  // namespace tessera
