// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A raw SocketCAN socket on one interface that receives only certain identifiers, returns the
// kernel's time of each frame, never waits, and reports the state of bus and interface. Not for
// several threads at once; no heap after open().
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/file_descriptor.hpp"
#include "base/outcome.hpp"
#include "vehicle/bus_values.hpp"
#include "vehicle/can_frame.hpp"

namespace tessera {

/// Counters never decrease. Those of the bus are reported by the controller's driver as error
/// frames, if it supports them.
struct CanSocketCounters {
  std::uint64_t received = 0;        ///< Received frames.
  std::uint64_t foreign = 0;         ///< Remote or extended frames, or of an invalid length.
  std::uint64_t kernel_dropped = 0;  ///< As the socket's buffer was full.
  std::uint64_t sent = 0;
  std::uint64_t no_buffer = 0;  ///< Tries to send while the interface's queue was full.
  std::uint64_t send_failed = 0;
  std::uint64_t error_frames = 0;  ///< The sum of all kinds, including those not listed here.
  std::uint64_t error_warnings = 0;
  std::uint64_t error_passive = 0;
  std::uint64_t bus_off = 0;
  std::uint64_t restarted = 0;
  std::uint64_t overflows = 0;  ///< Of the controller's buffers.
  std::uint64_t no_acknowledge = 0;
  std::uint64_t went_down = 0;  ///< Interface down, or gone.
  std::uint64_t stale = 0;      ///< Over two seconds old when they were read: left out.
  std::uint64_t no_stamp = 0;   ///< Frames without a kernel time, or with an invalid one.
};

struct CanSocketConfig {
  std::string interface = "can0";
  int receive_buffer_bytes = 256 * 1024;  ///< Requested; the system may grant less.
};

class CanSocket {
 public:
  enum class Read : std::uint8_t {
    kNothing,  ///< None waits.
    kFrame,
    kOther,  ///< An error frame, or a foreign one: continue reading.
    kDown,   ///< The interface is down; it may come up again, and the socket with it.
    kGone,   ///< The interface no longer exists: open again.
  };
  enum class Sent : std::uint8_t {
    kSent,
    kNoBuffer,  ///< The interface's queue is full: try again later.
    kDown,
    kGone,
    kFailed,  ///< It can never be sent here, as CAN FD on an interface without it.
  };

  /// ids: received identifiers, at most 512. Fails with kUsage iff the interface's name is invalid,
  /// it does not exist, or it is not a CAN interface; kFailure iff the system refuses.
  static Outcome<CanSocket> open(const CanSocketConfig& config, std::span<const std::uint32_t> ids);
  CanSocket() noexcept = default;

  /// The oldest waiting frame. received_us: when the kernel received it, by MonotonicClock. One
  /// system call, three if a stamp is converted.
  Read read(CanFrame& frame, std::int64_t& received_us) noexcept;
  /// One system call.
  Sent send(const CanFrame& frame) noexcept;
  /// Descriptor for poll().
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  [[nodiscard]] bool is_open() const noexcept { return socket_.is_open(); }
  /// True if the interface supports CAN FD.
  [[nodiscard]] bool can_fd() const noexcept { return can_fd_; }
  /// State by the last error frame, or kDown. A received frame ends kOff and kDown, a sent one
  /// kDown.
  [[nodiscard]] BusState state() const noexcept { return state_; }
  [[nodiscard]] const CanSocketCounters& counters() const noexcept { return counters_; }
  /// Continues the counters of an earlier socket.
  void count_from(const CanSocketCounters& counters) noexcept { counters_ = counters; }

 private:
  Read failed_read(int error) noexcept;
  void note_down() noexcept;
  void take_error_frame(const void* frame) noexcept;
  /// False: the frame is too old.
  [[nodiscard]] bool received_at(std::int64_t kernel_us, std::int64_t& received_us) noexcept;

  FileDescriptor socket_;
  bool can_fd_ = false;
  BusState state_ = BusState::kActive;
  std::int64_t day_ahead_us_ = 0;  ///< Time of day minus the monotonic clock, at the last frame.
  bool knows_day_ = false;
  std::uint32_t last_dropped_ = 0;  ///< Counted by the kernel.
  CanSocketCounters counters_{};
};

}  // namespace tessera
