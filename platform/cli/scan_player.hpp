// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sends recorded scans as sensors would: clouds, label and depth images and poses over LCM, each at
// the time at which it would be measured, stamped with the machine's clock; optionally poses over
// the vehicle's bus.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "cli/correction_files.hpp"
#include "cli/play_timeline.hpp"
#include "link/sensor_sender.hpp"
#include "scans/registrar.hpp"
#include "scans/replay_source.hpp"
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
  std::int32_t sensor = 0;    ///< Number of the clouds or depth images.
  bool semantic = true;       ///< Clouds with components, else as measured, with images and times.
  bool sends_poses = true;    ///< Over LCM.
  bool loop = false;          ///< Plays forward and backward in turn.
  std::string can_interface;  ///< Poses over that bus; empty: none.
  std::uint32_t can_base_id = kDefaultBaseId;
  std::uint32_t robot = 0;  ///< Of corrections.
  /// Corrected poses of the first scans, a row each; each is sent after its last scan.
  std::vector<CorrectionFile> corrections{};
  std::function<void(std::uint64_t scans)>
      progress;  ///< Called with the number of sent scans; or none.
};

struct PlayerReport {
  std::uint64_t scans = 0;
  std::uint64_t images = 0;     ///< Of labels.
  std::uint64_t poses = 0;      ///< Over LCM or CAN.
  std::uint64_t bad_poses = 0;  ///< Scans sent without a pose, as theirs is not rigid.
  std::uint64_t late = 0;  ///< Delays by over a period, after which everything later was postponed.
  std::int64_t worst_late_us = 0;  ///< Of what was sent.
  std::uint64_t corrections = 0;
  std::uint64_t frames = 0;       ///< Over CAN.
  std::uint64_t frames_lost = 0;  ///< Refused by the bus.
};

class ScanPlayer {
 public:
  /// scans must outlive the player and, unless config.semantic, be opened with their motion and
  /// images and without deskewing. Fails as SensorSender::open, CanSocket::open, Registrar::make,
  /// PlayTimeline::make and Thread::start.
  static Outcome<std::unique_ptr<ScanPlayer>> open(const PlayerConfig& config,
                                                   const RecordedScans& scans);

  /// Sends all of it once, after what was sent before; may be called again with config.loop only.
  /// Fails as RecordedScans::read; with kUsage iff a sweep is stretched over more than a message
  /// can hold; with kFailure iff the system does not send, or the bus is gone.
  Outcome<void> play();

  [[nodiscard]] const PlayerReport& report() const noexcept { return report_; }
  [[nodiscard]] const SensorSender& sender() const noexcept { return *sender_; }

 private:
  static constexpr int kMeasurement = -1;

  /// What is sent of a scan: a camera's labels, or the cloud or depth image.
  struct Part {
    std::int64_t due_us = 0;  ///< On the time scale of PlayTimeline.
    std::int64_t stamp_us = 0;
    std::int64_t begin_us = 0;  ///< Start that it is stamped by, where that differs from begin_us_.
    int camera = kMeasurement;  ///< Or its place among the images.
    std::shared_ptr<Scan> scan;
  };
  /// The item that is due next.
  enum class Next : std::uint8_t { kNothing, kPose, kCycle, kPart };

  ScanPlayer(const PlayerConfig& config, const RecordedScans& scans, PlayTimeline there,
             PlayTimeline back, std::unique_ptr<SensorSender> sender,
             std::unique_ptr<Registrar> registrar);
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
  Outcome<void> send_corrections();
  Outcome<void> send(const std::string& channel, const std::vector<std::byte>& message);

  const PlayerConfig config_;
  const RecordedScans& scans_;
  const PlayTimeline there_;
  const PlayTimeline back_;
  std::unique_ptr<SensorSender> sender_;
  std::unique_ptr<Registrar> registrar_;    ///< Null: scans are sent as measured.
  std::vector<CameraDescription> cameras_;  ///< Whose images are sent with clouds.
  WakeUp wake_;
  ReplaySource source_;
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
  std::vector<std::int64_t> sent_us_;  ///< Stamps of the scans that were sent, in their order.
  std::vector<Part> parts_;            ///< Fetched ones, in the order in which they are due.
  PlayerReport report_;
};

}  // namespace tessera
