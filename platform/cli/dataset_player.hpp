// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sends a dataset as sensors would: clouds, label images and poses over LCM, each at the time at
// which it would be measured, stamped with the machine's clock; optionally poses over the vehicle's
// bus.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "cli/play_timeline.hpp"
#include "link/sensor_sender.hpp"
#include "scans/dataset.hpp"
#include "scans/scan_ahead.hpp"
#include "scans/sensor_port.hpp"
#include "vehicle/can_socket.hpp"
#include "vehicle/simulated_vehicle.hpp"

namespace tessera {

struct PlayerConfig {
  std::string url = kDefaultSensorUrl;
  std::string interface = "lo";
  SensorChannels channels{};
  SensorClock clock = SensorClock::kMonotonic;
  double rate_hz = 10.0;
  std::int32_t sensor = 0;    ///< Number of the clouds.
  bool semantic = true;       ///< Clouds with components, else without, with images and times.
  bool sends_poses = true;    ///< Over LCM.
  bool loop = false;          ///< Plays forward and backward in turn.
  std::string can_interface;  ///< Poses over that bus; empty: none.
  std::uint32_t can_base_id = kDefaultBaseId;
  std::function<void(std::uint64_t scans)>
      progress;  ///< Called with the number of sent scans; or none.
};

struct PlayerReport {
  std::uint64_t scans = 0;
  std::uint64_t images = 0;
  std::uint64_t poses = 0;      ///< Over LCM or CAN.
  std::uint64_t bad_poses = 0;  ///< Scans sent without a pose, as theirs is not rigid.
  std::uint64_t late = 0;  ///< Delays by over a period, after which everything later was postponed.
  std::int64_t worst_late_us = 0;  ///< Of what was sent.
  std::uint64_t frames = 0;        ///< Over CAN.
  std::uint64_t frames_lost = 0;   ///< Refused by the bus.
};

class DatasetPlayer {
 public:
  /// dir: of the dataset, which must outlive the player and, unless config.semantic, be opened with
  /// with_motion and without deskewing. Fails as SensorSender::open, CanSocket::open and
  /// PlayTimeline::make; and, unless config.semantic, where there is a cameras.toml as
  /// CameraLabels::open and check_images.
  static Outcome<std::unique_ptr<DatasetPlayer>> open(const PlayerConfig& config,
                                                      const Dataset& dataset,
                                                      const std::string& dir);

  /// Sends all of it once, after what was sent before; may be called again with config.loop only.
  /// Fails as ScanAhead::next; with kUsage iff a sweep is stretched over more than a message can
  /// hold; with kFailure iff the system does not send, or the bus is gone.
  Outcome<void> play();

  [[nodiscard]] const PlayerReport& report() const noexcept { return report_; }
  [[nodiscard]] const SensorSender& sender() const noexcept { return *sender_; }

 private:
  static constexpr int kCloud = -1;

  /// What is sent of a scan: a camera's image, or the cloud.
  struct Part {
    std::int64_t due_us = 0;  ///< On the time scale of PlayTimeline.
    std::int64_t stamp_us = 0;
    std::int64_t begin_us = 0;  ///< Start that it is stamped by, where that differs from begin_us_.
    int camera = kCloud;
    std::shared_ptr<const ScanToPlay> scan;
  };
  /// The item that is due next.
  enum class Next : std::uint8_t { kNothing, kPose, kCycle, kPart };

  DatasetPlayer(const PlayerConfig& config, const Dataset& dataset, PlayTimeline there,
                PlayTimeline back, std::unique_ptr<SensorSender> sender, ScanAhead::Source source);
  Outcome<void> open_bus();
  void begin_pass();
  [[nodiscard]] Next next(std::int64_t& due_us) const;
  Outcome<void> fetch_until(std::int64_t due_us);
  Outcome<void> fetch();
  void wait_until(std::int64_t due_us);
  /// Postpones everything that follows by this time.
  void put_off(std::int64_t due_us, std::int64_t by_us);
  [[nodiscard]] std::int64_t stamp_of(const Part& part) const {
    return (part.begin_us != 0 ? part.begin_us : begin_us_) + part.stamp_us + clock_ahead_us_;
  }
  Outcome<void> send_pose();
  Outcome<void> send_cycle(std::int64_t due_us);
  Outcome<void> send_part();
  Outcome<void> send_cloud(const Part& part);
  Outcome<void> send(const std::string& channel, const std::vector<std::byte>& message);

  const PlayerConfig config_;
  const Dataset& dataset_;
  const PlayTimeline there_;
  const PlayTimeline back_;
  std::unique_ptr<SensorSender> sender_;
  std::vector<CameraDescription> cameras_;
  ScanAhead ahead_;
  std::optional<CanSocket> bus_;
  SimulatedVehicle vehicle_;
  std::int64_t earliest_us_ = 0;  ///< Of the parts of a scan, from its stamp.
  // Of a pass.
  const PlayTimeline* timeline_ = &there_;
  std::int64_t begin_us_ = 0;  ///< Monotonic, of the first scan's stamp; once known.
  bool has_begun_ = false;
  std::int64_t clock_ahead_us_ = 0;  ///< The sensors' clock minus the monotonic one.
  std::int64_t last_us_ = 0;         ///< Monotonic, when something was due last.
  std::size_t next_scan_ = 0;        ///< The first that is not fetched.
  std::size_t next_pose_ = 0;
  std::int64_t next_cycle_us_ = 0;
  std::vector<Part> parts_;  ///< Fetched ones, in the order in which they are due.
  PlayerReport report_;
};

}  // namespace tessera
