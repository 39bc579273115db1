// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The node's access to the vehicle's bus: a thread that reads, judges poses, takes commands, and
// sends what is due. It passes data through queues and cells that are allocated at the start, so no
// thread waits for it, and nothing on the bus stops it: excess frames of a flood are dropped, and
// it waits for a bus that is off or an interface that is gone.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

#include "base/latest_value.hpp"
#include "base/monotonic_clock.hpp"
#include "base/spsc_queue.hpp"
#include "base/thread.hpp"
#include "tessera/base/counters.hpp"
#include "vehicle/can_socket.hpp"
#include "vehicle/vehicle_inputs.hpp"
#include "vehicle/vehicle_outputs.hpp"

namespace tessera {

struct VehiclePortConfig {
  CanSocketConfig socket{};
  VehicleInputsConfig inputs{};
  bool can_fd = false;  ///< Whether sectors are sent in frames of CAN FD.
  std::size_t pose_slots = 256;
  std::size_t command_slots = 16;
  ThreadRole thread{.name = "tessera-can"};
};

#define TESSERA_VEHICLE_PORT_COUNTERS(ROW)                                                 \
  ROW(COUNTER, uint64_t, pose_timeouts, "Times that no pose came in time.")                \
  ROW(COUNTER, uint64_t, relocations, "Times that poses changed to another frame.")        \
  ROW(COUNTER, uint64_t, poses_dropped, "Poses lost, as the queue was full.")              \
  ROW(COUNTER, uint64_t, commands_dropped, "Commands lost, as the queue was full.")        \
  ROW(COUNTER, uint64_t, cycles_skipped, "Cycles of frames to send that were skipped.")    \
  ROW(COUNTER, uint64_t, frames_retried, "Sent later, as the interface's queue was full.") \
  ROW(COUNTER, uint64_t, frames_given_up,                                                  \
      "Not sent: queue full for too long, or bus or interface gone.")                      \
  ROW(COUNTER, uint64_t, reopened, "Times that the interface came back.")

/// The state of the port at one moment. Counters never decrease.
struct VehiclePortState {
  TESSERA_VEHICLE_PORT_COUNTERS(TESSERA_COUNTER_MEMBER)
  BusReport bus{};
  MotionState motion = MotionState::kUnknown;
  CanSocketReport socket{};
  VehicleInputReport inputs{};
  std::array<std::uint64_t, kPoseVerdicts> verdicts{};
};
TESSERA_COUNTER_TABLE(VehiclePortState, TESSERA_VEHICLE_PORT_COUNTERS(TESSERA_COUNTER_ROW))

class VehiclePort {
 public:
  /// Number of retries, kTurnUs apart, for a frame while the interface's queue is full.
  static constexpr int kMostTries = 10;
  static constexpr std::int64_t kTurnUs = 2'000;
  /// Frames sent per turn: fit into a queue of ten, the kernel's default.
  static constexpr std::size_t kMostPerTurn = 3;
  static constexpr int kMostReads = 64;               ///< Frames read per turn.
  static constexpr std::int64_t kReopenUs = 250'000;  ///< Between tries to open the interface.

  /// Fails as CanSocket::open, with kUsage iff the base identifier is invalid (is_base_id) or
  /// can_fd is requested of an interface without it, and with kFailure iff the system refuses the
  /// thread. Uses the heap; afterwards only opening an interface again does.
  static Outcome<std::unique_ptr<VehiclePort>> open(const VehiclePortConfig& config);
  VehiclePort(const VehiclePort&) = delete;
  VehiclePort& operator=(const VehiclePort&) = delete;
  /// Stops the thread, which takes at most a turn.
  ~VehiclePort();

  /// Poses and commands, each for one reading thread (which may be the same).
  [[nodiscard]] SpscQueue<JudgedPose>& poses() noexcept { return poses_; }
  [[nodiscard]] SpscQueue<TakenCommand>& commands() noexcept { return commands_; }
  /// Sets the report for the vehicle; if it is not renewed within half a second, the vehicle is
  /// notified of that instead. For one thread; never waits.
  void report(const VehicleReport& report) noexcept { report_.set(report); }
  /// For any thread, as LatestValue::get.
  [[nodiscard]] bool status(VehiclePortState& into) const noexcept { return status_.get(into); }

 private:
  /// A frame that waits for room in the interface's queue. A later one of its identifier replaces
  /// it.
  struct Waiting {
    CanFrame frame{};
    int tries = 0;  ///< 0: none waits.
  };

  VehiclePort(const VehiclePortConfig& config, CanSocket socket);
  Outcome<void> start();
  void run() noexcept;
  void turn(std::int64_t now) noexcept;
  void read_waiting() noexcept;
  void hand_over(const VehicleInputs::Taken& taken) noexcept;
  void send_due(std::int64_t now) noexcept;
  void send(const CanFrame& frame) noexcept;
  void retry_waiting() noexcept;
  void close_socket(std::int64_t now) noexcept;
  void reopen(std::int64_t now) noexcept;
  /// A frame for which the bus had no room.
  [[nodiscard]] bool a_frame_waits() const noexcept;
  void tell_status(std::int64_t now) noexcept;
  [[nodiscard]] std::int64_t now() const noexcept { return MonotonicClock::now_us(); }

  const VehiclePortConfig config_;
  CanSocket socket_;
  VehicleInputs inputs_;
  VehicleOutputs outputs_;
  SpscQueue<JudgedPose> poses_;
  SpscQueue<TakenCommand> commands_;
  LatestValue<VehicleReport> report_;
  LatestValue<VehiclePortState> status_;
  VehicleReport latest_report_{};
  VehiclePortState counted_{};
  std::array<Waiting, kBusIds> waiting_{};  ///< By offset from the base.
  std::size_t room_ = 0;                    ///< Frames that may still be sent in this turn.
  bool queue_full_ = false;                 ///< Found so in this turn.
  bool more_is_due_ = false;
  std::int64_t reopen_us_ = 0;
  FileDescriptor stop_;
  Thread thread_;
};

}  // namespace tessera
