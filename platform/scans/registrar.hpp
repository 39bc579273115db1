// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Turns scans, live or recorded, into the input of the integrator: corrects motion, adds labels of
// cameras, makes points of depth images. Allocates all memory at the start.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/arena_memory.hpp"
#include "base/latest_value.hpp"
#include "base/outcome.hpp"
#include "scans/cameras_toml.hpp"
#include "scans/scan.hpp"
#include "tessera/registration/depth_image.hpp"
#include "tessera/registration/deskew.hpp"

namespace tessera {

struct RegistrarConfig {
  std::vector<CameraDescription> cameras;  ///< By their numbers in messages or cameras.toml.
  int num_classes = 0;
  ScanLimits limits{};
  DeskewConfig deskew{};
  LabelProjectionConfig projection{};
  DepthConfig depth{};
  /// Number of the camera that depth images come from; -1: none.
  int depth_camera = -1;
  Matrix34d T_body_lidar = Matrix34d::Identity();
};

/// What was done to a scan.
struct RegistrationRecord {
  std::optional<DeskewReport> deskew{};     ///< If it has times.
  std::optional<LabelReport> projection{};  ///< If it was labelled by cameras.
  std::optional<DepthReport> depth{};       ///< If it is a depth image.
};

/// Sums over the scans.
struct RegistrarReport {
  std::uint64_t deskewed = 0;  ///< Scans.
  std::uint64_t not_deskewed =
      0;                    ///< Scans with times, but without poses around them: used as they are.
  std::uint64_t moved = 0;  ///< Points of deskewed scans,
  std::uint64_t points_unplaced = 0;  ///< and those without time or pose, which were not moved.
  std::uint64_t projected = 0;        ///< Scans that were labelled by cameras.
  std::uint64_t projected_points = 0;
  std::uint64_t labelled = 0;             ///< Of these points.
  std::uint64_t occluded = 0;             ///< Once per camera.
  std::uint64_t images_without_pose = 0;  ///< At the time of the image or the scan: left out.
  /// Images of another size than the camera, or of an unknown camera; depth images ignore such
  /// labels.
  std::uint64_t images_refused = 0;
  std::uint64_t depth_images = 0;
  std::uint64_t depth_points = 0;
  std::uint64_t no_depth = 0;       ///< Sampled pixels, as the next two.
  std::uint64_t flying = 0;         ///< At the edges of depths.
  std::uint64_t depth_refused = 0;  ///< Flying ones and those that are too near, too far, or
                                    ///< without a ray.
  std::uint64_t refused = 0;        ///< Scans that could not be used.

  void add(const RegistrationRecord& record) noexcept;
};

class Registrar {
 public:
  /// Fails with kUsage iff a mask cannot be read or a number is out of its range; kFailure iff the
  /// system does not give the memory.
  static Outcome<std::unique_ptr<Registrar>> make(const RegistrarConfig& config);
  Registrar(const Registrar&) = delete;
  Registrar& operator=(const Registrar&) = delete;

  /// Converts the scan for the integrator; changes it. False, and counted, if it cannot be used.
  /// The points of a depth image are the registrar's, until the next call. No heap, no system call.
  /// Cost: that of deskew, LabelProjector::project and DepthCamera::to_points.
  bool view(Scan& scan, ScanView& into) noexcept;
  /// Of the last call of view(), for the same thread.
  [[nodiscard]] const RegistrationRecord& last() const noexcept { return last_; }
  /// For any thread.
  [[nodiscard]] const LatestValue<RegistrarReport>& report() const noexcept { return report_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return memory_.span().size(); }

 private:
  explicit Registrar(const RegistrarConfig& config) : config_(config) {}
  Outcome<void> set_up();
  [[nodiscard]] std::size_t required_bytes() const;
  Outcome<void> read_masks();
  void take_out_motion(Scan& scan, const PoseTrack& track) noexcept;
  void take_labels(Scan& scan, const PoseTrack& track) noexcept;
  [[nodiscard]] Status place(const ScanImage& image, const Scan& scan, const PoseTrack& track,
                             LabelCamera& into) noexcept;
  bool take_depths(Scan& scan, ScanView& into) noexcept;

  RegistrarConfig config_;
  ArenaMemory memory_;
  std::vector<std::vector<std::uint8_t>> masks_;  ///< Empty for cameras without one.
  PoseTrack track_;
  LabelProjector projector_;
  DepthCamera depth_;
  std::span<float> depth_points_;
  std::span<std::uint8_t> depth_components_;
  RegistrationRecord last_{};
  RegistrarReport counted_{};
  LatestValue<RegistrarReport> report_;
};

}  // namespace tessera
