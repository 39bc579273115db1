// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sends a dataset as sensors would: a cloud a scan and its pose, stamped with the machine's clock,
// at an even rate.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "dataset/dataset.hpp"
#include "lcm/sensor_sender.hpp"
#include "posix/outcome.hpp"
#include "sensing/sensor_port.hpp"

namespace tessera {

struct PlayerConfig {
  std::string url = kDefaultSensorUrl;
  std::string interface = "lo";
  SensorChannels channels{};
  SensorClock clock = SensorClock::kMonotonic;
  double rate_hz = 10.0;
  std::int32_t sensor = 0;  ///< Number of the clouds.
  bool semantic = true;     ///< Clouds with components, else without.
  bool sends_poses = true;
};

struct PlayerReport {
  std::uint64_t scans = 0;
  std::uint64_t poses = 0;
  std::uint64_t bad_poses = 0;  ///< Not rigid: their scans are sent without.
  std::uint64_t late = 0;       ///< Scans that were sent after the next one was due.
};

class DatasetPlayer {
 public:
  /// Fails as SensorSender::open. dataset: must outlive the player.
  static Outcome<std::unique_ptr<DatasetPlayer>> open(const PlayerConfig& config,
                                                      const Dataset& dataset);

  /// Waits until scan i is due, the next period after the last one, and sends its pose and it.
  /// Fails as Dataset::read; with kFailure iff the system does not send.
  Outcome<void> play(std::size_t i);

  [[nodiscard]] const PlayerReport& report() const noexcept { return report_; }
  [[nodiscard]] const SensorSender& sender() const noexcept { return *sender_; }

 private:
  DatasetPlayer(const PlayerConfig& config, const Dataset& dataset,
                std::unique_ptr<SensorSender> sender);
  /// Gives the moment's stamp in the sensors' clock.
  std::int64_t wait_until_due();
  Outcome<void> send(const std::string& channel, const std::vector<std::byte>& message);

  const PlayerConfig config_;
  const Dataset& dataset_;
  std::unique_ptr<SensorSender> sender_;
  ScanBuffer buffer_;
  std::vector<float> xyz_;
  std::int64_t due_us_ = 0;
  PlayerReport report_;
};

}  // namespace tessera
