// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Makes the due frames from the latest report. No clock, no heap, no waiting: the caller sends
// them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "vehicle/bus_table.hpp"
#include "vehicle/can_frame.hpp"
#include "vehicle/vehicle_report.hpp"

namespace tessera {

struct VehicleOutputsConfig {
  std::uint32_t base_id = kDefaultBaseId;  ///< See is_base_id().
  /// With an older report the heartbeat has Fault and Silent, and sectors are marked as held.
  std::int64_t report_timeout_us = 500'000;
  bool can_fd = false;  ///< Sectors in frames of CAN FD: all nodes on the bus must support them.
};

class VehicleOutputs {
 public:
  /// Identifiers within the base's 32 that are sent.
  static constexpr std::size_t kMessages = kBusIds - bus::kIdHeartbeat;

  /// config.base_id: if it is none, that of the default is used.
  explicit VehicleOutputs(const VehicleOutputsConfig& config = {}) noexcept;

  /// Writes the due frames to into, those of the highest priority first, at most into.size() of
  /// them; the others stay due. Returns their number. now_us: by any clock that never decreases.
  /// All sectors of a summary are of one report, even if several calls send them. A message that
  /// could not be sent for a whole cycle is sent once, and counted as skipped. O(into.size() * 64 +
  /// 32).
  std::size_t due(const VehicleReport& report, const BusReport& bus, std::int64_t now_us,
                  std::span<CanFrame> into) noexcept;
  /// Time when a frame is due next; valid after the first call of due().
  [[nodiscard]] std::int64_t next_due_us() const noexcept;
  /// Cycles of messages that were skipped because due() was called too seldom or with too little
  /// room.
  [[nodiscard]] std::uint64_t skipped() const noexcept { return skipped_; }
  [[nodiscard]] const VehicleOutputsConfig& config() const noexcept { return config_; }

 private:
  struct Schedule {
    const BusMessage* message = nullptr;
    std::int64_t next_us = 0;
    std::uint8_t counter = 0;
  };

  void start(std::int64_t now_us) noexcept;
  [[nodiscard]] bool is_used(const BusMessage& message) const noexcept;
  [[nodiscard]] bool is_silent(const VehicleReport& report, std::int64_t now_us) const noexcept {
    return now_us - std::max(report.made_us, start_us_) > config_.report_timeout_us;
  }
  void write(Schedule& schedule, const VehicleReport& report, const BusReport& bus,
             std::int64_t now_us, CanFrame& frame) noexcept;
  void begin_summary(const SectorsReport& sectors, bool silent) noexcept;

  VehicleOutputsConfig config_;
  std::array<Schedule, kMessages> schedules_{};  ///< By identifier.
  SectorsReport sectors_{};                      ///< Of the summary that is sent now.
  std::uint8_t summary_ = 0;
  std::uint64_t skipped_ = 0;
  bool started_ = false;
  std::int64_t start_us_ = 0;  ///< Of the first call of due(): there may be no report yet.
};

}  // namespace tessera
