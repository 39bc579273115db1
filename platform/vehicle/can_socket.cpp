// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/can_socket.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "base/monotonic_clock.hpp"

namespace tessera {
namespace {

constexpr std::size_t kMostIds = 512;
/// A frame does not wait this long in a buffer: the clock was set meanwhile.
constexpr std::int64_t kMostWaitUs = 2'000'000;

std::int64_t microseconds_of(const timespec& time) noexcept {
  return std::int64_t{time.tv_sec} * 1'000'000 + std::int64_t{time.tv_nsec} / 1'000;
}

template <class Value>
bool set_option(const FileDescriptor& socket, int level, int name, const Value& value) {
  return ::setsockopt(socket.get(), level, name, &value, sizeof value) == 0;
}

Failure refused(const std::string& what, const std::string& interface, int error,
                FailureKind kind) {
  std::string message = "cannot use the CAN interface \"" + one_line(interface) + "\": " + what;
  if (error != 0) message += std::string(": ") + std::strerror(error);
  return {message + "; see \"ip -details link show type can\"", kind};
}

bool set_filters(const FileDescriptor& socket, std::span<const std::uint32_t> ids) {
  std::array<can_filter, kMostIds> filters{};
  const std::size_t count = std::min(ids.size(), filters.size());
  for (std::size_t i = 0; i < count; ++i)
    filters[i] = {ids[i] & CAN_SFF_MASK, CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG};
  return ::setsockopt(socket.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                      static_cast<socklen_t>(count * sizeof(can_filter))) == 0;
}

/// Metadata of a frame.
struct Attached {
  std::int64_t kernel_us = 0;  ///< CLOCK_REALTIME; 0 without a stamp.
  std::uint32_t dropped = 0;
};

Attached attached_to(msghdr& message) noexcept {
  Attached attached;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SO_RXQ_OVFL) {
      std::memcpy(&attached.dropped, CMSG_DATA(c), sizeof attached.dropped);
    } else if (c->cmsg_type == SO_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
      attached.kernel_us = microseconds_of(stamp);
    }
  }
  return attached;
}

std::int64_t time_of_day_us() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return microseconds_of(now);
}

}  // namespace

Outcome<CanSocket> CanSocket::open(const CanSocketConfig& config,
                                   std::span<const std::uint32_t> ids) {
  const auto fails = [&](const std::string& what, int error, FailureKind kind) {
    return refused(what, config.interface, error, kind);
  };
  if (config.interface.empty() || config.interface.size() >= IFNAMSIZ)
    return fails("a name must have 1 to 15 characters", 0, FailureKind::kUsage);
  const unsigned index = ::if_nametoindex(config.interface.c_str());
  if (index == 0) return fails("it does not exist", 0, FailureKind::kUsage);
  CanSocket made;
  made.socket_ = FileDescriptor(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
  if (!made.socket_.is_open()) return fails("no socket", errno, FailureKind::kFailure);
  const FileDescriptor& socket = made.socket_;
  ifreq request{};
  config.interface.copy(request.ifr_name, IFNAMSIZ - 1);
  made.can_fd_ = ::ioctl(socket.get(), SIOCGIFMTU, &request) == 0 && request.ifr_mtu == CANFD_MTU;
  constexpr int kOn = 1;
  constexpr int kOff = 0;
  constexpr can_err_mask_t kErrors = CAN_ERR_MASK;
  // In this order: what arrives between bind() and the filters would not be filtered.
  const bool set = set_filters(socket, ids) &&
                   set_option(socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, kErrors) &&
                   set_option(socket, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, kOff) &&
                   (!made.can_fd_ || set_option(socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, kOn)) &&
                   set_option(socket, SOL_SOCKET, SO_RXQ_OVFL, kOn) &&
                   set_option(socket, SOL_SOCKET, SO_TIMESTAMPNS, kOn);
  if (!set) return fails("it does not support a required option", errno, FailureKind::kFailure);
  // A smaller buffer is not a failure: losses are counted.
  static_cast<void>(set_option(socket, SOL_SOCKET, SO_RCVBUF, config.receive_buffer_bytes));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    if (errno == ENODEV) return fails("it is not a CAN interface", 0, FailureKind::kUsage);
    return fails("cannot bind", errno, FailureKind::kFailure);
  }
  return made;
}

/// The kernel reports an error only once, either to reading or to sending.
void CanSocket::note_down() noexcept {
  if (state_ != BusState::kDown) ++counters_.went_down;
  state_ = BusState::kDown;
}

CanSocket::Read CanSocket::failed_read(int error) noexcept {
  if (error == EAGAIN || error == EWOULDBLOCK) return Read::kNothing;
  if (error == EINTR || error == ENOBUFS) return Read::kOther;
  note_down();
  return error == ENETDOWN ? Read::kDown : Read::kGone;
}

CanSocket::Read CanSocket::read(CanFrame& frame, std::int64_t& received_us) noexcept {
  canfd_frame raw{};
  alignas(cmsghdr)
      std::array<std::byte, CMSG_SPACE(sizeof(std::uint32_t)) + CMSG_SPACE(sizeof(timespec))>
          control{};
  iovec part{&raw, sizeof raw};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t count = ::recvmsg(socket_.get(), &message, 0);
  if (count < 0) return failed_read(errno);
  const Attached attached = attached_to(message);
  // The kernel counts from the start of the socket, in 32 bits.
  if (attached.dropped != 0) counters_.kernel_dropped += attached.dropped - last_dropped_;
  if (attached.dropped != 0) last_dropped_ = attached.dropped;
  if ((raw.can_id & CAN_ERR_FLAG) != 0) {
    take_error_frame(&raw);
    return Read::kOther;
  }
  // The size of a frame gives its kind; not all drivers set the flag for it.
  const bool is_fd = count == CANFD_MTU;
  const bool fits =
      (is_fd && raw.len <= CANFD_MAX_DLEN) || (count == CAN_MTU && raw.len <= CAN_MAX_DLEN);
  if (!fits || (raw.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) != 0) {
    ++counters_.foreign;
    return Read::kOther;
  }
  ++counters_.received;
  // A controller that is off or down receives nothing; a passive one does.
  if (state_ != BusState::kPassive) state_ = BusState::kActive;
  frame = {.id = raw.can_id & CAN_SFF_MASK, .size = raw.len, .is_fd = is_fd};
  std::copy_n(raw.data, raw.len, frame.data.begin());
  return received_at(attached.kernel_us, received_us) ? Read::kFrame : Read::kOther;
}

/// The kernel stamps by the time of day, which may be set at any moment, so only the age is used.
/// An implausible age is due to the clock if it was set since the last frame; otherwise the frame
/// has waited, as this process did not run.
bool CanSocket::received_at(std::int64_t kernel_us, std::int64_t& received_us) noexcept {
  constexpr std::int64_t kStep_us = 50'000;
  const std::int64_t now = MonotonicClock::now_us();
  const std::int64_t day_us = time_of_day_us();
  const std::int64_t ahead_us = day_us - now;
  const bool was_set =
      knows_day_ && (ahead_us - day_ahead_us_ > kStep_us || day_ahead_us_ - ahead_us > kStep_us);
  day_ahead_us_ = ahead_us;
  knows_day_ = true;
  received_us = now;
  const std::int64_t ago = day_us - kernel_us;
  if (kernel_us == 0 || ago < 0 || (ago > kMostWaitUs && was_set)) {
    ++counters_.no_stamp;
    return true;
  }
  if (ago > kMostWaitUs) {
    ++counters_.stale;
    return false;
  }
  received_us = now - ago;
  return true;
}

void CanSocket::take_error_frame(const void* frame) noexcept {
  can_frame error{};
  std::memcpy(&error, frame, sizeof error);
  ++counters_.error_frames;
  const auto has = [&](std::uint32_t what) { return (error.can_id & what) != 0; };
  const auto tells = [&](unsigned what) {
    return has(CAN_ERR_CRTL) && (error.data[1] & what) != 0;
  };
  if (has(CAN_ERR_ACK)) ++counters_.no_acknowledge;
  if (tells(CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) ++counters_.overflows;
  if (tells(CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) {
    ++counters_.error_warnings;
    // Drivers report no more than that on the way back from passive.
    if (state_ == BusState::kPassive) state_ = BusState::kActive;
  }
  if (tells(CAN_ERR_CRTL_ACTIVE)) state_ = BusState::kActive;
  if (tells(CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) {
    ++counters_.error_passive;
    state_ = BusState::kPassive;
  }
  if (has(CAN_ERR_RESTARTED)) {
    ++counters_.restarted;
    state_ = BusState::kActive;
  }
  if (has(CAN_ERR_BUSOFF)) {
    ++counters_.bus_off;
    state_ = BusState::kOff;
  }
}

CanSocket::Sent CanSocket::send(const CanFrame& frame) noexcept {
  canfd_frame raw{};
  raw.can_id = frame.id & CAN_SFF_MASK;
  raw.len = frame.size;
  raw.flags = frame.is_fd ? CANFD_BRS : 0;
  std::copy_n(frame.data.begin(), std::min<std::size_t>(frame.size, sizeof raw.data), raw.data);
  // Both kinds begin in the same way.
  const std::size_t bytes = frame.is_fd ? CANFD_MTU : CAN_MTU;
  ssize_t sent = -1;
  do {
    sent = ::send(socket_.get(), &raw, bytes, MSG_NOSIGNAL | MSG_DONTWAIT);
  } while (sent < 0 && errno == EINTR);
  if (sent >= 0) {
    ++counters_.sent;
    if (state_ == BusState::kDown) state_ = BusState::kActive;
    return Sent::kSent;
  }
  if (errno == ENOBUFS || errno == EAGAIN) {
    ++counters_.no_buffer;
    return Sent::kNoBuffer;
  }
  const int error = errno;
  ++counters_.send_failed;
  if (error != ENETDOWN && error != ENXIO && error != ENODEV) return Sent::kFailed;
  note_down();
  return error == ENETDOWN ? Sent::kDown : Sent::kGone;
}

}  // namespace tessera
