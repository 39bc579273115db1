// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sensors of this machine: receives their messages over LCM, matches what belongs together, and
// gives complete scans to the mapping thread, which never waits and makes no system call for it.
// After open() nothing uses the heap.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "base/shared_report.hpp"
#include "base/spsc_queue.hpp"
#include "base/thread.hpp"
#include "link/sensor_link.hpp"
#include "link/sensor_messages.hpp"
#include "scans/sensor_matcher.hpp"
#include "settings/setting_member.hpp"

namespace tessera {

/// Names, 1 to 63 bytes each; one of each kind, as messages carry their sensor's number.
struct SensorChannels {
  std::string semantic_cloud = "TESSERA_SEMANTIC_CLOUD";
  std::string cloud = "TESSERA_CLOUD";
  std::string label_image = "TESSERA_LABEL_IMAGE";
  std::string depth_image = "TESSERA_DEPTH_IMAGE";
  std::string pose = "TESSERA_POSE";  ///< Empty: poses come only by add_pose().
  std::string correction = "TESSERA_CORRECTION";
};

/// The clock of the sensors' stamps; everything that stamps for this machine must use the same.
enum class SensorClock : std::uint8_t {
  kMonotonic,  ///< CLOCK_MONOTONIC, microseconds: has no steps.
  kWall,       ///< CLOCK_REALTIME, microseconds since 1970.
};
constexpr const char* to_string(SensorClock clock) noexcept {
  return clock == SensorClock::kWall ? "wall" : "monotonic";
}
template <>
inline constexpr std::array kChoicesOf<SensorClock>{SensorClock::kMonotonic, SensorClock::kWall};

/// Called for each pose that comes over LCM, in the sensing thread; without one all are taken.
struct PoseFilter {
  void* context = nullptr;
  /// stamp_now_us: now, by the sensors' clock.
  bool (*may_use)(void* context, const PoseMessage& pose, std::int64_t stamp_now_us) = nullptr;
};

/// A correction as it came, in memory of its own; slots of a queue.
struct CorrectionMessage {
  static constexpr std::size_t kMostPoses = 16'384;
  CorrectionHeader header{};
  std::vector<std::int64_t> keys = std::vector<std::int64_t>(kMostPoses);
  std::vector<double> transforms = std::vector<double>(12 * kMostPoses);
};

struct SensorPortConfig {
  SensorLinkConfig link{};
  SensorChannels channels{};
  MatcherConfig matcher{};
  SensorClock clock = SensorClock::kMonotonic;
  bool takes_degraded_poses = true;
  PoseFilter pose_filter{};
  std::uint32_t robot = 0;         ///< Whose corrections are taken.
  bool takes_corrections = false;  ///< Else they are messages of another channel.
};

/// All counters, from the socket to the mapping thread.
struct SensorReport {
  SensorLinkReport link{};
  // Messages from the link: each is counted in one of these, or in match.
  std::uint64_t other_channel = 0;
  std::array<std::uint64_t, 6> faults{};  ///< By MessageFault; the first is unused.
  std::uint64_t poses_invalid = 0;        ///< Marked so by the sender, or degraded and not wanted.
  std::uint64_t poses_filtered = 0;       ///< Refused by the filter.
  std::uint64_t pose_gaps = 0;         ///< Sequence numbers without a pose; a restart counts none.
  std::uint64_t poses_queue_full = 0;  ///< Of add_pose().
  std::uint64_t corrections = 0;       ///< Passed on.
  std::uint64_t corrections_foreign = 0;  ///< Of another robot: refused.
  std::uint64_t corrections_dropped = 0;  ///< Two were waiting already.
  MatchReport match{};
  std::uint64_t longest_match_us = 0;  ///< From the arrival of a scan until it was given out.
};

class SensorPort final : private SensorSink {
 public:
  /// Fails as SensorLink::open; also with kUsage iff a channel name is too long or a duplicate.
  /// The only use of the heap.
  static Outcome<std::unique_ptr<SensorPort>> open(const SensorPortConfig& config);
  /// Bytes that open() allocates on the heap, apart from names.
  [[nodiscard]] static std::size_t required_bytes(const SensorPortConfig& config) noexcept;
  SensorPort(const SensorPort&) = delete;
  SensorPort& operator=(const SensorPort&) = delete;
  ~SensorPort();

  /// Starts a thread "tessera-sense" that calls step() until the port ends. Fails with kFailure iff
  /// the system gives no thread. Signals are blocked in it.
  Outcome<void> start();
  /// The work of the sensing thread, for callers with a thread of their own: waits for messages, at
  /// most timeout_us, takes up to 256 datagrams, and gives out what is ready. Call it again within
  /// max_wait_us.
  void step(std::int64_t timeout_us) noexcept;
  /// Wakes a step() that waits. For any thread.
  void wake() noexcept { link_->wake(); }

  /// The oldest ready scan, which the caller owns until pop(); nullptr: there is none. For one
  /// thread; neither waits nor makes a system call.
  [[nodiscard]] Scan* front() noexcept;
  /// Returns the scan of front(). A caller bug unless front() returned one since the last call.
  void pop() noexcept;

  /// Adds a pose from elsewhere, for example the vehicle's bus. False, and counted, iff 256 wait.
  /// For one thread; never waits.
  bool add_pose(const StampedPose& pose) noexcept;
  /// As SensorMatcher::forget_poses(), also for poses of add_pose() that still wait. For the thread
  /// that calls step(), also from a filter of poses.
  void forget_poses() noexcept;

  /// The oldest correction that waits, which the caller owns until pop_correction(); nullptr: there
  /// is none. For one thread; neither waits nor makes a system call.
  [[nodiscard]] const CorrectionMessage* correction() noexcept { return corrections_.front(); }
  void pop_correction() noexcept { corrections_.pop(); }

  /// For any thread.
  [[nodiscard]] SensorReport report() const noexcept { return shared_report_.load(); }
  /// The current time of the sensors' clock.
  [[nodiscard]] std::int64_t stamp_now_us() const noexcept;
  [[nodiscard]] const SensorLink& link() const noexcept { return *link_; }

 private:
  static constexpr std::size_t kPoseQueue = 256;
  static constexpr std::size_t kCorrectionQueue = 2;

  SensorPort(const SensorPortConfig& config, std::unique_ptr<SensorLink> link);
  void take(std::string_view channel, std::span<const std::byte> payload) noexcept override;
  void take_cloud(std::span<const std::byte> payload, bool semantic) noexcept;
  void take_label_image(std::span<const std::byte> payload) noexcept;
  void take_depth_image(std::span<const std::byte> payload) noexcept;
  void take_pose(std::span<const std::byte> payload) noexcept;
  void take_correction(std::span<const std::byte> payload) noexcept;
  /// True iff there is no fault; counts it otherwise.
  bool is_fine(MessageFault fault) noexcept;
  [[nodiscard]] SensorTime time() const noexcept;
  void hand_over() noexcept;
  void run() noexcept;

  const SensorPortConfig config_;
  std::unique_ptr<SensorLink> link_;
  SensorMatcher matcher_;
  SpscQueue<Scan*> ready_;
  SpscQueue<Scan*> back_;
  SpscQueue<StampedPose> poses_;
  SpscQueue<CorrectionMessage> corrections_;
  std::atomic<std::uint64_t> poses_queue_full_{0};
  std::int32_t last_pose_number_ = 0;
  bool knows_pose_number_ = false;
  SensorReport report_{};
  SharedReport<SensorReport> shared_report_;
  std::atomic<bool> stop_{false};
  Thread thread_;
};

}  // namespace tessera
