// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The frames of a robot's submaps in its world, and the poses with which they were mapped, so that
// a corrected trajectory gives new frames. Of a submap a fixed number of poses is kept, spread over
// all of its scans; in fixed memory.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/rigid_code.hpp"
#include "tessera/map/local_maps.hpp"

namespace tessera {

/// A corrected trajectory: a view of the caller's arrays.
struct CorrectedTrajectory {
  std::span<const std::int64_t> stamps_us;  ///< Ascending, in the clock of the scans.
  /// [R | t] of each, rows first: twelve times as many numbers as there are stamps.
  std::span<const double> T_world_sensor;
};

/// Corrected frames of submaps: a view, as CorrectedTrajectory.
struct CorrectedFrames {
  std::span<const std::uint32_t> submaps;
  std::span<const double> T_world_map;
};

/// What became of a correction.
struct CorrectionReport {
  /// kOk: it was applied. kInvalidArgument: its revision is not above that of the one before, it
  /// has nothing, sizes differ, a pose is not rigid or farther than RigidCode::kMostMetres, stamps
  /// do not ascend, or a submap is unknown or given twice; then nothing was changed.
  Status status = Status::kOk;
  std::uint32_t revision = 0;  ///< That is in force now.
  std::uint32_t moved = 0;     ///< Submaps whose frame is another one now.
  double most_m = 0.0;         ///< How far one was moved, at its middle pose.
  /// From the corrected places to where the frames put the poses: root of the mean square.
  double residual_m = 0.0;
};

/// What is kept of a submap: bytes that may be copied, for other threads and for files.
struct SubmapFrame {
  /// Poses at most.
  static constexpr std::size_t kPoses = 16;
  /// A scan's.
  struct Pose {
    std::int64_t stamp_us = 0;
    RigidCode T_map_sensor{};
    friend constexpr bool operator==(const Pose&, const Pose&) = default;
  };
  RigidCode frame{};           ///< T_world_map.
  std::uint32_t revision = 1;  ///< How often it was moved, plus one.
  std::uint32_t noted = 0;     ///< Scans.
  std::uint32_t stride = 1;    ///< Of which each so-manieth is kept.
  std::uint32_t count = 0;     ///< Poses.
  bool continues = true;       ///< As SubmapFrames::begin.
  std::array<Pose, kPoses> poses{};
};

class SubmapFrames {
 public:
  static constexpr std::size_t kPoses = SubmapFrame::kPoses;

  /// Bytes of arena that make takes.
  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t submaps) noexcept {
    return arena_bytes<Row>(submaps);
  }
  /// Room for so many submaps, from 1. first: number of the first one, which lies in the world
  /// as it is mapped. Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<SubmapFrames> make(Arena& arena, std::uint32_t submaps,
                                                 std::uint32_t first) noexcept;
  /// Holds nothing.
  SubmapFrames() noexcept = default;

  // --- Mapping -----------------------------------------------------------------------------------

  /// The pose of a scan of a submap, in the order in which they were mapped. Of no account if the
  /// submap is unknown, the pose is no transform, or the stamp not above that of the last one.
  /// O(1).
  void note(std::uint32_t submap, std::int64_t stamp_us, const Matrix34d& T_map_sensor) noexcept;
  /// Begins the submap that maps is in, if that is the next one. It lies in the frame `asked`, if
  /// one is given; else in that of the one before, and if its poses are in another frame, in the
  /// world as it is mapped. True iff one began. maps begins no more submaps than there is room for.
  /// O(1).
  bool follow(const LocalMaps& maps, const std::optional<Matrix34d>& asked) noexcept;
  /// Another submap begins. T_world_map: its frame. continues: its poses are in the frame of those
  /// before, so that a correction which does not reach it moves it as them. Fails with
  /// kResourceExhausted iff there is no room for it, or no number left. O(1).
  [[nodiscard]] Status begin(const Matrix34d& T_world_map, bool continues = true) noexcept;

  // --- Over restarts -----------------------------------------------------------------------------

  /// All that is kept of a submap that there is; its frame as by round_rigid. O(1).
  [[nodiscard]] SubmapFrame saved(std::uint32_t submap) const noexcept;
  /// Takes what an earlier start has saved, instead of all that there is. first: number of the
  /// first; revision: of its last correction. Fails with kInvalidArgument iff there is none, or one
  /// is none: counts beyond their range, stamps that do not ascend, a frame or a pose that
  /// decode_rigid does not take; kResourceExhausted iff there is no room. Then nothing was changed.
  /// O(frames).
  [[nodiscard]] Status restore(std::span<const SubmapFrame> frames, std::uint32_t first,
                               std::uint32_t revision) noexcept;

  // --- Frames ------------------------------------------------------------------------------------

  [[nodiscard]] std::uint32_t first() const noexcept { return first_; }
  [[nodiscard]] std::uint32_t last() const noexcept { return first_ + count_ - 1; }
  [[nodiscard]] bool has(std::uint32_t submap) const noexcept {
    return submap >= first_ && submap - first_ < count_;
  }
  /// T_world_map; submap: one that there is.
  [[nodiscard]] const Matrix34d& frame(std::uint32_t submap) const noexcept {
    return row(submap).T_world_map;
  }
  /// How often it was moved, plus one.
  [[nodiscard]] std::uint32_t revision_of(std::uint32_t submap) const noexcept {
    return row(submap).revision;
  }
  /// Whether the last correction moved it.
  [[nodiscard]] bool moved(std::uint32_t submap) const noexcept { return row(submap).moved; }
  /// Of the last correction that was applied; 0: none was.
  [[nodiscard]] std::uint32_t revision() const noexcept { return revision_; }
  /// Moves one. Fails with kInvalidArgument iff there is no such submap or it is no frame that
  /// encode_rigid takes. O(1).
  [[nodiscard]] Status set(std::uint32_t submap, const Matrix34d& T_world_map) noexcept;

  // --- Corrections -------------------------------------------------------------------------------

  /// A corrected trajectory, by ascending stamps. Each submap gets the frame that takes its poses
  /// nearest to the corrected ones (FrameFit), which lie between two poses of the trajectory as
  /// interpolate() has it. A submap behind its end moves as the last one with a pose did;
  /// one in front of its begin stays. Frames are rounded as by round_rigid. revision: above that of
  /// the last correction. O(submaps kPoses log(poses) + poses).
  CorrectionReport correct(const CorrectedTrajectory& trajectory, std::uint32_t revision) noexcept;
  /// The frames themselves. O(frames + submaps).
  CorrectionReport correct(const CorrectedFrames& frames, std::uint32_t revision) noexcept;

 private:
  using Pose = SubmapFrame::Pose;
  struct Row : SubmapFrame {
    Matrix34d T_world_map = Matrix34d::Identity();
    bool named = false;  ///< Scratch: by the correction at hand.
    bool moved = false;  ///< By the last one.
  };
  struct Residual {
    double squares = 0.0;
    std::size_t poses = 0;
  };
  [[nodiscard]] const Row& row(std::uint32_t submap) const noexcept {
    return rows_[submap - first_];
  }
  [[nodiscard]] static Status check(const CorrectedTrajectory& trajectory) noexcept;
  [[nodiscard]] Status check(const CorrectedFrames& frames) noexcept;
  void begin_correction(std::uint32_t revision, CorrectionReport& report) noexcept;
  static void fit(Row& row, const CorrectedTrajectory& trajectory, std::optional<Matrix34d>& last,
                  Residual& residual, CorrectionReport& report) noexcept;
  static void move(Row& row, const Matrix34d& T_world_map, CorrectionReport& report) noexcept;

  std::span<Row> rows_{};
  std::uint32_t first_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t revision_ = 0;
};

}  // namespace tessera
