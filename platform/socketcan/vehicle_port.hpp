// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The node's place on the vehicle's bus: a thread that reads, judges poses, takes commands, and
// sends what is due. It hands over through queues and cells that are there from the start, so
// nobody waits for it, and nothing on the bus stops it: a flood is dropped by number, a bus that is
// off or an interface that is gone is waited for.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

#include "posix/latest_value.hpp"
#include "posix/monotonic_clock.hpp"
#include "posix/spsc_queue.hpp"
#include "posix/thread.hpp"
#include "socketcan/can_socket.hpp"
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

/// All that the port knows, as of one moment. Counters only grow.
struct VehiclePortStatus {
  BusReport bus{};
  MotionState motion = MotionState::kUnknown;
  CanSocketCounters socket{};
  VehicleInputCounters inputs{};
  std::array<std::uint64_t, kPoseVerdicts> verdicts{};
  std::uint64_t pose_timeouts = 0;
  std::uint64_t relocations = 0;
  std::uint64_t poses_dropped = 0;     ///< For want of room in the queue.
  std::uint64_t commands_dropped = 0;  ///< The same.
  std::uint64_t cycles_skipped = 0;    ///< Of frames to be sent, as VehicleOutputs::skipped().
  std::uint64_t frames_retried = 0;    ///< Sent later, as the interface's queue was full.
  std::uint64_t frames_given_up = 0;   ///< Not sent: full for too long, or bus or interface gone.
  std::uint64_t reopened = 0;          ///< Times that the interface came back.
};

class VehiclePort {
 public:
  /// A frame that finds the interface's queue full is tried again so often, kTurnUs apart.
  static constexpr int kMostTries = 10;
  static constexpr std::int64_t kTurnUs = 2'000;
  /// Frames sent in a turn: a queue of ten, the kernel's default, has room for them.
  static constexpr std::size_t kMostPerTurn = 3;
  static constexpr int kMostReads = 64;               ///< Frames read in a turn.
  static constexpr std::int64_t kReopenUs = 250'000;  ///< Between tries to open the interface.

  /// Fails as CanSocket::open, with kUsage iff the base identifier is none (is_base_id) or can_fd
  /// is asked of an interface without, and with kFailure iff the system refuses the thread. Uses
  /// the heap; after it only trying to open an interface that is gone does.
  static Outcome<std::unique_ptr<VehiclePort>> open(const VehiclePortConfig& config);
  VehiclePort(const VehiclePort&) = delete;
  VehiclePort& operator=(const VehiclePort&) = delete;
  /// Stops the thread, which takes a turn at most.
  ~VehiclePort();

  /// Poses and commands, to be read by one thread each (which may be the same).
  [[nodiscard]] SpscQueue<JudgedPose>& poses() noexcept { return poses_; }
  [[nodiscard]] SpscQueue<TakenCommand>& commands() noexcept { return commands_; }
  /// What the vehicle is to be told from now on; if it does not come again within half a second,
  /// the vehicle is told of that instead. For one thread; never waits.
  void report(const VehicleReport& report) noexcept { report_.set(report); }
  /// For any thread; as LatestValue::get.
  [[nodiscard]] bool status(VehiclePortStatus& into) const noexcept { return status_.get(into); }

 private:
  /// A frame that waits for room in the interface's queue. A later one of its identifier takes its
  /// place.
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
  /// One that the bus had no room for.
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
  LatestValue<VehiclePortStatus> status_;
  VehicleReport latest_report_{};
  VehiclePortStatus counted_{};
  std::array<Waiting, kBusIds> waiting_{};  ///< By place behind the base.
  std::size_t room_ = 0;                    ///< Frames that may still be sent in this turn.
  bool queue_full_ = false;                 ///< Found so in this turn.
  bool more_is_due_ = false;
  std::int64_t reopen_us_ = 0;
  FileDescriptor stop_;
  Thread thread_;
};

}  // namespace tessera
