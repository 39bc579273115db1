// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Matches a sweep, the label images taken at that time, and the poses around it, by their stamps.
// Pure: no system call, no clock; allocates at construction only.
//
// A scan (cloud or depth image) waits, max_wait_us at most, until
//   - the pose track has passed the end of its sweep and its images, and
//   - of each camera that it needs, the image nearest to its stamp is known: one that is not before
//     the stamp has come, or one before it that is nearer than the next can be, by the distance of
//     the camera's last two. A depth image needs only the labels of its own camera and stamp.
// Scans are given out in the order of their stamps; a complete scan waits for an older one that
// still waits. docs/reference/sensors.md has the policy as a table.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/arena_memory.hpp"
#include "scans/match_report.hpp"
#include "scans/scan.hpp"
#include "tessera/base/arena.hpp"

namespace tessera {

enum class MissingImages : std::uint8_t {
  kUnlabelled,  ///< Takes the scan with the available images, even without any.
  kDrop,        ///< Drops the scan unless all images are available.
};
constexpr const char* to_string(MissingImages missing) noexcept {
  return missing == MissingImages::kDrop ? "drop" : "unlabelled";
}

enum class MountedKind : std::uint8_t { kSemanticCloud, kRawCloud, kDepthCamera };

/// A sensor that scans may come from. Clouds and depth cameras are numbered separately.
struct MountedSensor {
  std::int32_t number = 0;
  MountedKind kind = MountedKind::kSemanticCloud;
  Matrix34d T_body_sensor = Matrix34d::Identity();
};

struct MatcherConfig {
  std::vector<MountedSensor> sensors{};  ///< Up to 16.
  /// Cameras whose label images raw clouds need, up to Scan::kMostCameras.
  std::vector<std::int32_t> cameras{};
  ScanLimits slot{};              ///< Its number of cameras is set from the above.
  std::size_t pending_scans = 4;  ///< Scans that wait for partners, 1 .. 16.
  std::size_t handed_scans = 2;   ///< Scans that are given out, 1 .. 16.
  std::size_t images = 4;         ///< Images kept of each camera, 2 .. 16.
  std::size_t poses = 512;        ///< Poses kept, 2 .. 65,536.
  std::int64_t max_wait_us = 100'000;
  std::int64_t max_image_offset_us = 50'000;
  std::int64_t max_pose_gap_us = 150'000;
  std::int64_t max_age_us = 500'000;    ///< Older stamps are refused.
  std::int64_t max_future_us = 20'000;  ///< Stamps farther ahead are refused.
  std::int64_t max_step_us = 100'000;   ///< Of the sensors' clock against the monotonic one.
  MissingImages missing_images = MissingImages::kUnlabelled;
};

/// The current time by two clocks.
struct SensorTime {
  std::int64_t now_us = 0;        ///< Monotonic.
  std::int64_t stamp_now_us = 0;  ///< Of the clock that sensors stamp with; may be the same.
};

class SensorMatcher {
 public:
  /// Clamps numbers to their ranges and cuts lists. The only use of the heap.
  explicit SensorMatcher(const MatcherConfig& config);
  SensorMatcher(const SensorMatcher&) = delete;
  SensorMatcher& operator=(const SensorMatcher&) = delete;
  /// Bytes that a matcher allocates on the heap.
  [[nodiscard]] static std::size_t required_bytes(const MatcherConfig& config) noexcept;

  /// Slot for writing the next scan: kind, sensor, stamp_us, sizes, times and content. The same
  /// until add_scan().
  [[nodiscard]] Scan& next_scan() noexcept { return slots_[spare_]; }
  /// Takes the content of next_scan(), or refuses it, counted: a sensor that is not configured, a
  /// stamp too far from now, one of this sensor that it has or gave out, or older than one that it
  /// gave out. If too many scans wait, drops the oldest.
  void add_scan(const SensorTime& time) noexcept;

  /// Slot for writing the next label image. The same until add_image().
  [[nodiscard]] ScanImage& next_image() noexcept { return images_[spare_image_]; }
  /// Takes the content of next_image(), or refuses it, counted: a camera that is not configured, a
  /// stamp too far from now, or not later than that camera's last. Replaces the camera's oldest.
  void add_image(const SensorTime& time) noexcept;

  /// Takes a pose, or refuses it, counted: not rigid, a stamp too far from now or not later than
  /// the last one's.
  void add_pose(const StampedPose& pose, const SensorTime& time) noexcept;
  /// Starts poses of another frame: no pose is interpolated between old and new ones, so a scan of
  /// the time between has no pose.
  void forget_poses() noexcept { track_.clear(); }

  /// The oldest scan that is complete or has waited long enough; nullptr: there is none, or
  /// handed_scans were taken and not given back. Drops, counted, scans that will never have a pose.
  /// While there is no room, keeps only the newest of the ready scans.
  [[nodiscard]] Scan* take_ready(const SensorTime& time) noexcept;
  /// Returns a slot of take_ready().
  void give_back(const Scan* slot) noexcept;

  [[nodiscard]] const MatchReport& report() const noexcept { return report_; }
  [[nodiscard]] std::size_t pending() const noexcept { return num_pending_; }
  [[nodiscard]] const PoseTrack& track() const noexcept { return track_; }

 private:
  static constexpr std::size_t kMostSensors = 16;
  static constexpr std::size_t kNone = SIZE_MAX;

  struct Mounted {
    MountedSensor sensor{};
    std::int64_t last_us = INT64_MIN;  ///< Stamp of the last scan that was given out.
  };
  struct Camera {
    std::int32_t number = 0;
    bool of_clouds = false;  ///< Needed by raw clouds.
    std::size_t first = 0;   ///< Its images in images_, config_.images of them.
    std::size_t count = 0;   ///< Number of them in use; rising stamps.
  };
  /// The state of a scan's partners.
  enum class Partners : std::uint8_t { kWaits, kReady, kNever };
  struct Choice {
    std::size_t image = kNone;
    bool settled = false;  ///< No better image can come.
  };

  [[nodiscard]] Mounted* mounted(const Scan& scan) noexcept;
  [[nodiscard]] bool is_timely(std::int64_t stamp_us, const SensorTime& time,
                               TimelinessCounts& counts) const noexcept;
  void watch_clock(const SensorTime& time) noexcept;
  void forget_all() noexcept;
  void drop_pending(std::size_t at) noexcept;
  [[nodiscard]] bool is_known(const Scan& scan, const Mounted& from) noexcept;
  [[nodiscard]] Choice choose(const Camera& camera, const Scan& scan) const noexcept;
  [[nodiscard]] bool needs(const Scan& scan, const Camera& camera) const noexcept;
  /// Finds the scan's partners and stores them in choices_.
  [[nodiscard]] Partners look_for_partners(const Scan& scan, bool waited) noexcept;
  void attach(Scan& scan) noexcept;
  void attach_poses(Scan& scan, std::int64_t first_us, std::int64_t last_us) const noexcept;
  [[nodiscard]] bool has_waited(const Scan& scan, const SensorTime& time) const noexcept {
    return time.now_us - scan.taken_us >= config_.max_wait_us;
  }

  MatcherConfig config_;
  std::unique_ptr<Scan[]> slots_;
  std::vector<std::size_t> free_;  ///< A stack.
  std::size_t num_free_ = 0;
  std::size_t spare_ = 0;
  std::vector<std::size_t> pending_;  ///< By rising stamp.
  std::size_t num_pending_ = 0;
  std::size_t handed_ = 0;
  std::vector<Mounted> mounted_;
  std::vector<Camera> cameras_;
  std::vector<Choice> choices_;  ///< Of each camera, for the scan that was checked last.
  std::unique_ptr<std::uint8_t[]> image_bytes_;
  std::vector<ScanImage> images_;
  std::size_t spare_image_ = 0;
  ArenaMemory track_memory_;
  PoseTrack track_;
  std::int64_t clock_offset_us_ = 0;
  bool knows_clock_ = false;
  MatchReport report_;
};

}  // namespace tessera
