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
#include "tessera/base/counters.hpp"
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
  RobotBody body{};  ///< Its points keep their places where motion is taken out.
};

/// What was done to a scan.
struct RegistrationRecord {
  std::optional<DeskewReport> deskew{};     ///< If it has times.
  std::optional<LabelReport> projection{};  ///< If it was labelled by cameras.
  std::optional<DepthReport> depth{};       ///< If it is a depth image.
};

#define TESSERA_REGISTRAR_COUNTERS(ROW)                                                            \
  ROW(COUNTER, uint64_t, deskewed, "Scans that were deskewed.")                                    \
  ROW(COUNTER, uint64_t, not_deskewed,                                                             \
      "Scans with times, but without poses around them: used as they are.")                        \
  ROW(COUNTER, uint64_t, moved, "Points of deskewed scans that were moved.")                       \
  ROW(COUNTER, uint64_t, points_unplaced,                                                          \
      "Points of deskewed scans without time or pose, which were not moved.")                      \
  ROW(COUNTER, uint64_t, projected, "Scans that were labelled by cameras.")                        \
  ROW(COUNTER, uint64_t, projected_points, "Points of these scans.")                               \
  ROW(COUNTER, uint64_t, labelled, "Of these points, those that a camera labelled.")               \
  ROW(COUNTER, uint64_t, occluded,                                                                 \
      "Points that a camera did not label, as others occlude them; once per camera.")              \
  ROW(COUNTER, uint64_t, images_without_pose,                                                      \
      "Images left out: no pose at the time of the image or the scan.")                            \
  ROW(COUNTER, uint64_t, images_refused,                                                           \
      "Images of another size than the camera, or of an unknown camera; depth images ignore such " \
      "labels.")                                                                                   \
  ROW(COUNTER, uint64_t, depth_images, "Depth images.")                                            \
  ROW(COUNTER, uint64_t, depth_points, "Points from depth images.")                                \
  ROW(COUNTER, uint64_t, no_depth, "Sampled pixels without depth.")                                \
  ROW(COUNTER, uint64_t, flying, "Sampled pixels at the edges of depths.")                         \
  ROW(COUNTER, uint64_t, depth_refused,                                                            \
      "Sampled pixels that are flying, too near, too far or without a ray.")                       \
  ROW(COUNTER, uint64_t, refused, "Scans that could not be used.")

/// Sums over the scans.
struct RegistrarReport {
  TESSERA_REGISTRAR_COUNTERS(TESSERA_COUNTER_MEMBER)
  void add(const RegistrationRecord& record) noexcept;
};
TESSERA_COUNTER_TABLE(RegistrarReport, TESSERA_REGISTRAR_COUNTERS(TESSERA_COUNTER_ROW))

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
