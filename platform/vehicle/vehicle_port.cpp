// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/vehicle_port.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace tessera {
namespace {

struct Ids {
  std::array<std::uint32_t, kBusIds> ids{};
  std::size_t count = 0;
};

Ids ids_to_hear(std::uint32_t base) noexcept {
  Ids heard;
  for (const BusMessage& message : kBusMessages)
    if (message.from_vehicle) heard.ids[heard.count++] = base + message.place;
  return heard;
}

Outcome<CanSocket> open_socket(const VehiclePortConfig& config) {
  const Ids heard = ids_to_hear(config.inputs.base_id);
  return CanSocket::open(config.socket, std::span(heard.ids).first(heard.count));
}

}  // namespace

VehiclePort::VehiclePort(const VehiclePortConfig& config, CanSocket socket)
    : config_(config),
      socket_(std::move(socket)),
      inputs_(config.inputs),
      outputs_({.base_id = config.inputs.base_id, .can_fd = config.can_fd}),
      poses_(config.pose_slots),
      commands_(config.command_slots) {}

VehiclePort::~VehiclePort() {
  if (!thread_.is_running()) return;
  static_cast<void>(!::eventfd_write(stop_.get(), 1));
  thread_.join();
}

Outcome<std::unique_ptr<VehiclePort>> VehiclePort::open(const VehiclePortConfig& config) {
  if (!is_base_id(config.inputs.base_id)) {
    return Failure{fmt::format(
        "cannot use the CAN base identifier {}; choose a multiple of 32 up to 2016 (0x7e0)",
        config.inputs.base_id)};
  }
  TESSERA_TRY_ASSIGN(CanSocket socket, open_socket(config));
  if (config.can_fd && !socket.can_fd()) {
    return Failure{"cannot send CAN FD on \"" + one_line(config.socket.interface) +
                   "\": it takes classic frames only; leave CAN FD off, or set the interface up "
                   "with \"fd on\""};
  }
  std::unique_ptr<VehiclePort> port(new VehiclePort(config, std::move(socket)));
  TESSERA_TRY(port->start());
  return port;
}

Outcome<void> VehiclePort::start() {
  stop_ = FileDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!stop_.is_open()) {
    return Failure{std::string("cannot start the thread for CAN: ") + std::strerror(errno) +
                       "; close other programs, then try again",
                   FailureKind::kFailure};
  }
  return thread_.start(
      config_.thread, [](void* port) { static_cast<VehiclePort*>(port)->run(); }, this);
}

void VehiclePort::run() noexcept {
  std::int64_t next_turn_us = 0;
  while (true) {
    const std::int64_t before = now();
    const std::int64_t wait_us = std::clamp<std::int64_t>(next_turn_us - before, 0, kReopenUs);
    const timespec timeout{0, static_cast<long>(wait_us * 1'000)};
    // A descriptor below zero is ignored.
    pollfd sources[] = {{socket_.is_open() ? socket_.descriptor() : -1, POLLIN, 0},
                        {stop_.get(), POLLIN, 0}};
    if (::ppoll(sources, 2, &timeout, nullptr) < 0 && errno != EINTR) return;
    if (sources[1].revents != 0) return;
    if (socket_.is_open() && sources[0].revents != 0) read_waiting();
    const std::int64_t after = now();
    // If the clock was set back, the turn must not wait for it to catch up.
    if (after < next_turn_us && next_turn_us - after <= kReopenUs) continue;
    turn(after);
    const std::int64_t due_us = std::clamp(outputs_.next_due_us(), after, after + kReopenUs);
    next_turn_us = std::max(after + kTurnUs, more_is_due_ || a_frame_waits() ? after : due_us);
  }
}

bool VehiclePort::a_frame_waits() const noexcept {
  return std::any_of(waiting_.begin(), waiting_.end(),
                     [](const Waiting& waiting) { return waiting.tries > 0; });
}

void VehiclePort::turn(std::int64_t now) noexcept {
  if (!socket_.is_open() && now >= reopen_us_) reopen(now);
  static_cast<void>(report_.get(latest_report_));
  queue_full_ = false;
  room_ = kMostPerTurn;
  retry_waiting();
  send_due(now);
  tell_status(now);
}

void VehiclePort::read_waiting() noexcept {
  CanFrame frame;
  std::int64_t received_us = 0;
  for (int i = 0; i < kMostReads; ++i) {
    switch (socket_.read(frame, received_us)) {
      case CanSocket::Read::kNothing:
      case CanSocket::Read::kDown:
        return;
      case CanSocket::Read::kOther:
        break;
      case CanSocket::Read::kGone:
        return close_socket(now());
      case CanSocket::Read::kFrame:
        hand_over(inputs_.take(frame, received_us));
        break;
    }
  }
}

void VehiclePort::hand_over(const VehicleInputs::Taken& taken) noexcept {
  if (taken.pose.has_value()) {
    JudgedPose* const slot = poses_.claim();
    if (slot == nullptr) {
      ++counted_.poses_dropped;
    } else {
      *slot = *taken.pose;
      poses_.publish();
    }
  }
  if (taken.command.has_value()) {
    TakenCommand* const slot = commands_.claim();
    if (slot == nullptr) {
      ++counted_.commands_dropped;
    } else {
      *slot = *taken.command;
      commands_.publish();
    }
  }
}

void VehiclePort::send_due(std::int64_t now) noexcept {
  const BusReport bus{.pose_verdict = inputs_.pose_state(now),
                      .pose_source = inputs_.pose_source(now),
                      .bus = socket_.is_open() ? socket_.state() : BusState::kDown};
  std::array<CanFrame, kMostPerTurn> frames;
  const std::size_t count = outputs_.due(latest_report_, bus, now, std::span(frames).first(room_));
  more_is_due_ = count == room_;
  for (const CanFrame& frame : std::span(frames).first(count)) send(frame);
}

void VehiclePort::send(const CanFrame& frame) noexcept {
  Waiting& waiting = waiting_[(frame.id - config_.inputs.base_id) % kBusIds];
  if (std::exchange(waiting.tries, 0) > 0) ++counted_.frames_given_up;
  if (!socket_.is_open()) {
    ++counted_.frames_given_up;
    return;
  }
  const CanSocket::Sent sent = queue_full_ ? CanSocket::Sent::kNoBuffer : socket_.send(frame);
  if (sent == CanSocket::Sent::kSent) return;
  if (sent == CanSocket::Sent::kNoBuffer) {
    queue_full_ = true;
    waiting = {frame, 1};
    return;
  }
  ++counted_.frames_given_up;
  if (sent == CanSocket::Sent::kGone) close_socket(now());
}

void VehiclePort::retry_waiting() noexcept {
  for (Waiting& waiting : waiting_) {
    if (waiting.tries == 0 || queue_full_ || room_ == 0) continue;
    if (!socket_.is_open() || waiting.tries > kMostTries) {
      waiting.tries = 0;
      ++counted_.frames_given_up;
      continue;
    }
    const CanFrame frame = waiting.frame;
    const int tries = std::exchange(waiting.tries, 0) + 1;
    ++counted_.frames_retried;
    --room_;
    send(frame);
    if (waiting.tries > 0) waiting.tries = tries;
  }
}

void VehiclePort::close_socket(std::int64_t now) noexcept {
  counted_.socket = socket_.counters();
  socket_ = {};
  reopen_us_ = now + kReopenUs;
}

void VehiclePort::reopen(std::int64_t now) noexcept {
  reopen_us_ = now + kReopenUs;
  // The interface may be missing for hours; its message is only for the start of the program.
  Outcome<CanSocket> socket = open_socket(config_);
  if (!socket.ok()) return;
  socket_ = std::move(*socket);
  socket_.count_from(counted_.socket);
  ++counted_.reopened;
}

void VehiclePort::tell_status(std::int64_t now) noexcept {
  VehiclePortState status = counted_;
  status.bus = {.pose_verdict = inputs_.pose_state(now),
                .pose_source = inputs_.pose_source(now),
                .bus = socket_.is_open() ? socket_.state() : BusState::kDown};
  status.motion = inputs_.motion(now);
  if (socket_.is_open()) status.socket = socket_.counters();
  status.inputs = inputs_.counters();
  for (std::size_t i = 0; i < status.verdicts.size(); ++i)
    status.verdicts[i] = inputs_.guard().count(static_cast<PoseVerdict>(i));
  status.pose_timeouts = inputs_.guard().timeouts();
  status.relocations = inputs_.guard().relocations();
  status.cycles_skipped = outputs_.skipped();
  status_.set(status);
}

}  // namespace tessera
