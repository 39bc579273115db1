// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Turns sensor data into the input of the integrator: corrects motion, adds labels of cameras,
// makes points of depth images. For the mapping thread; allocates all memory at the start.
#pragma once

#include <memory>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/latest_value.hpp"
#include "base/outcome.hpp"
#include "scans/cameras_toml.hpp"
#include "scans/scan_slot.hpp"
#include "tessera/registration/depth_image.hpp"
#include "tessera/registration/deskew.hpp"

namespace tessera {

struct RegistrarConfig {
  std::vector<CameraDescription> cameras;  ///< By their numbers in messages.
  int num_classes = 0;
  SlotCapacity slot{};
  DeskewConfig deskew{};
  LabelProjectionConfig projection{};
  DepthConfig depth{};
  /// Number of the camera that depth images come from; -1: none.
  int depth_camera = -1;
  Matrix34d T_body_lidar = Matrix34d::Identity();
};

/// Counters never decrease.
struct RegistrarReport {
  std::uint64_t deskewed = 0;  ///< Scans.
  std::uint64_t not_deskewed =
      0;  ///< Scans with times, but without poses around them: used as they are.
  std::uint64_t points_unplaced = 0;  ///< Points of deskewed scans.
  std::uint64_t projected = 0;        ///< Scans that were labelled by cameras.
  std::uint64_t labelled = 0;         ///< Points of labelled scans.
  std::uint64_t occluded = 0;         ///< Once per camera.
  std::uint64_t images_without_pose = 0;
  /// Images of another size than the camera, or of an unknown camera; depth images ignore such
  /// labels.
  std::uint64_t images_refused = 0;
  std::uint64_t depth_images = 0;
  std::uint64_t flying = 0;   ///< Pixels at the edges of depths.
  std::uint64_t refused = 0;  ///< Scans that could not be used.
};

class Registrar {
 public:
  /// Fails with kUsage iff a mask cannot be read or a number is out of its range; kFailure iff the
  /// system does not give the memory.
  static Outcome<std::unique_ptr<Registrar>> make(const RegistrarConfig& config);
  Registrar(const Registrar&) = delete;
  Registrar& operator=(const Registrar&) = delete;

  /// Converts the content of the slot for the integrator; changes the slot. False, and counted, if
  /// it cannot be used. No heap, no system call. Cost: that of deskew, LabelProjector::project and
  /// DepthCamera::to_points.
  bool view(ScanSlot& slot, ScanView& into) noexcept;
  /// For any thread.
  [[nodiscard]] const LatestValue<RegistrarReport>& report() const noexcept { return report_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return memory_.span().size(); }

 private:
  static constexpr std::int64_t kMaxGap_us = 250'000;

  explicit Registrar(const RegistrarConfig& config) : config_(config) {}
  Outcome<void> set_up();
  [[nodiscard]] std::size_t required_bytes() const;
  Outcome<void> read_masks();
  void take_out_motion(ScanSlot& slot) noexcept;
  void take_labels(ScanSlot& slot) noexcept;
  bool take_depths(ScanSlot& slot, ScanView& into) noexcept;

  RegistrarConfig config_;
  ArenaMemory memory_;
  std::vector<std::vector<std::uint8_t>> masks_;  ///< Empty for cameras without one.
  PoseTrack track_;
  LabelProjector projector_;
  DepthCamera depth_;
  std::span<float> depth_points_;
  std::span<std::uint8_t> depth_components_;
  RegistrarReport counted_{};
  LatestValue<RegistrarReport> report_;
};

}  // namespace tessera
