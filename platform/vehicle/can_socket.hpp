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
#include "tessera/base/counters.hpp"
#include "vehicle/bus_values.hpp"
#include "vehicle/can_frame.hpp"

namespace tessera {

#define TESSERA_CAN_SOCKET_COUNTERS(ROW)                                                         \
  ROW(COUNTER, uint64_t, received, "Received frames.")                                           \
  ROW(COUNTER, uint64_t, foreign, "Remote or extended frames, or of an invalid length.")         \
  ROW(COUNTER, uint64_t, kernel_dropped, "As the socket's buffer was full.")                     \
  ROW(COUNTER, uint64_t, sent, "Sent frames.")                                                   \
  ROW(COUNTER, uint64_t, no_buffer, "Tries to send while the interface's queue was full.")       \
  ROW(COUNTER, uint64_t, send_failed, "Frames that the system refused to send.")                 \
  ROW(COUNTER, uint64_t, error_frames, "The sum of all kinds, including those not listed here.") \
  ROW(COUNTER, uint64_t, error_warnings, "Error frames: warning level.")                         \
  ROW(COUNTER, uint64_t, error_passive, "Error frames: the controller is passive.")              \
  ROW(COUNTER, uint64_t, bus_off, "Error frames: bus off.")                                      \
  ROW(COUNTER, uint64_t, restarted, "Error frames: the controller has restarted.")               \
  ROW(COUNTER, uint64_t, overflows, "Of the controller's buffers.")                              \
  ROW(COUNTER, uint64_t, no_acknowledge, "Error frames: nobody acknowledged.")                   \
  ROW(COUNTER, uint64_t, went_down, "Interface down, or gone.")                                  \
  ROW(COUNTER, uint64_t, stale, "Over two seconds old when they were read: left out.")           \
  ROW(COUNTER, uint64_t, no_stamp, "Frames without a kernel time, or with an invalid one.")

/// Counters never decrease. Those of the bus are reported by the controller's driver as error
/// frames, if it supports them.
struct CanSocketReport {
  TESSERA_CAN_SOCKET_COUNTERS(TESSERA_COUNTER_MEMBER)
};
TESSERA_COUNTER_TABLE(CanSocketReport, TESSERA_CAN_SOCKET_COUNTERS(TESSERA_COUNTER_ROW))

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
  [[nodiscard]] const CanSocketReport& counters() const noexcept { return counters_; }
  /// Continues the counters of an earlier socket.
  void count_from(const CanSocketReport& counters) noexcept { counters_ = counters; }

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
  CanSocketReport counters_{};
};

}  // namespace tessera
