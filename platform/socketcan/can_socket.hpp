// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A raw SocketCAN socket on one interface that hears certain identifiers only, gives the kernel's
// time of each frame, never waits, and tells what happens to bus and interface. Not for several
// threads at once; no heap after open().
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "posix/file_descriptor.hpp"
#include "posix/outcome.hpp"
#include "vehicle/bus_values.hpp"
#include "vehicle/can_frame.hpp"

namespace tessera {

/// Each number only grows. Those of the bus are what the controller's driver reports as error
/// frames, if it does.
struct CanSocketCounters {
  std::uint64_t received = 0;        ///< Frames that were given.
  std::uint64_t foreign = 0;         ///< Remote or extended frames, or of a length that none has.
  std::uint64_t kernel_dropped = 0;  ///< For want of room in the socket's buffer.
  std::uint64_t sent = 0;
  std::uint64_t no_buffer = 0;  ///< Tries to send that found the interface's queue full.
  std::uint64_t send_failed = 0;
  std::uint64_t error_frames = 0;  ///< The sum of all kinds, also of those not named here.
  std::uint64_t error_warnings = 0;
  std::uint64_t error_passive = 0;
  std::uint64_t bus_off = 0;
  std::uint64_t restarted = 0;
  std::uint64_t overflows = 0;  ///< Of the controller's own buffers.
  std::uint64_t no_acknowledge = 0;
  std::uint64_t went_down = 0;  ///< Interface down, or gone.
  std::uint64_t stale = 0;      ///< Over two seconds old when they were read: left out.
  std::uint64_t no_stamp = 0;   ///< Frames whose time was not the kernel's, or made no sense.
};

struct CanSocketConfig {
  std::string interface = "can0";
  int receive_buffer_bytes = 256 * 1024;  ///< Asked of the system, which may grant less.
};

class CanSocket {
 public:
  enum class Read : std::uint8_t {
    kNothing,  ///< None waits.
    kFrame,
    kOther,  ///< An error frame, or one that is not ours: read on.
    kDown,   ///< The interface is down; it may come up again, and the socket with it.
    kGone,   ///< The interface is no more: open anew.
  };
  enum class Sent : std::uint8_t {
    kSent,
    kNoBuffer,  ///< The interface's queue is full: again later.
    kDown,
    kGone,
    kFailed,  ///< It cannot be sent here at all, as CAN FD on an interface without.
  };

  /// ids: those to hear, at most 512. Fails with kUsage iff the interface's name is none or there
  /// is no such interface, or it is no CAN interface; kFailure iff the system refuses.
  static Outcome<CanSocket> open(const CanSocketConfig& config, std::span<const std::uint32_t> ids);
  CanSocket() noexcept = default;

  /// The oldest frame that waits. received_us: by MonotonicClock, when the kernel
  /// got it. One system call, three where a stamp is converted.
  Read read(CanFrame& frame, std::int64_t& received_us) noexcept;
  /// One system call.
  Sent send(const CanFrame& frame) noexcept;
  /// To wait for with poll().
  [[nodiscard]] int descriptor() const noexcept { return socket_.get(); }
  [[nodiscard]] bool is_open() const noexcept { return socket_.is_open(); }
  /// Whether the interface takes CAN FD.
  [[nodiscard]] bool can_fd() const noexcept { return can_fd_; }
  /// By the last error frame, or kDown. A frame that comes ends kOff and kDown, one that is sent
  /// kDown.
  [[nodiscard]] BusState state() const noexcept { return state_; }
  [[nodiscard]] const CanSocketCounters& counters() const noexcept { return counters_; }
  /// Goes on counting from those of a socket before this one.
  void count_from(const CanSocketCounters& counters) noexcept { counters_ = counters; }

 private:
  Read failed_read(int error) noexcept;
  void note_down() noexcept;
  void take_error_frame(const void* frame) noexcept;
  /// False: the frame is too old to be of use.
  [[nodiscard]] bool received_at(std::int64_t kernel_us, std::int64_t& received_us) noexcept;

  FileDescriptor socket_;
  bool can_fd_ = false;
  BusState state_ = BusState::kActive;
  std::int64_t day_ahead_us_ = 0;  ///< Of the monotonic clock, the time of day, at the last frame.
  bool knows_day_ = false;
  std::uint32_t last_dropped_ = 0;  ///< As the kernel counts.
  CanSocketCounters counters_{};
};

}  // namespace tessera
