// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/network_port.hpp"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>

#include <cerrno>
#include <cstring>
#include <type_traits>
#include <utility>

#include "posix/monotonic_clock.hpp"

namespace tessera {

static_assert(std::is_trivially_copyable_v<NodeStatus> && sizeof(NodeStatus) <= kMaxMessageBytes);

NetworkPort::NetworkPort(std::unique_ptr<DatagramLink> link, std::size_t send_slots)
    : link_(std::move(link)), status_(*link_), queue_(send_slots) {}

Outcome<std::unique_ptr<NetworkPort>> NetworkPort::open(const LinkConfig& config,
                                                        std::size_t send_slots) {
  Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(config);
  if (!link.ok()) return link.failure();
  std::unique_ptr<NetworkPort> port(new NetworkPort(std::move(*link), send_slots));
  const Outcome<void> started = port->start();
  if (!started.ok()) return started.failure();
  return port;
}

Outcome<void> NetworkPort::start() {
  wake_ = FileDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  int error = wake_.is_open() ? 0 : errno;
  if (error == 0) {
    // Signals are for the program's own threads: this one inherits that all are blocked.
    sigset_t all{};
    sigset_t before{};
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    const auto run = [](void* port) -> void* {
      static_cast<NetworkPort*>(port)->send_until_stopped();
      return nullptr;
    };
    error = ::pthread_create(&thread_, nullptr, run, this);
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }
  if (error != 0) {
    return Failure{std::string("cannot start sending: ") + std::strerror(error) +
                       "; close other programs, then try again",
                   FailureKind::kFailure};
  }
  is_running_ = true;
  ::pthread_setname_np(thread_, "tessera-send");
  return {};
}

void NetworkPort::close() noexcept {
  if (!std::exchange(is_running_, false)) return;
  stopping_.store(true, std::memory_order_release);
  static_cast<void>(::eventfd_write(wake_.get(), 1) != 0);
  ::pthread_join(thread_, nullptr);
}

std::span<std::byte> NetworkPort::claim() noexcept {
  Slot* const slot = queue_.claim();
  if (slot == nullptr) {
    ++send_queue_full_;
    return {};
  }
  slot->is_status = false;
  return slot->payload;
}

void NetworkPort::commit(std::size_t bytes) noexcept {
  queue_.claim()->bytes = static_cast<std::uint32_t>(bytes);
  queue_.publish();
  unsent_ = true;
}

bool NetworkPort::report(const NodeStatus& status) noexcept {
  Slot* const slot = queue_.claim();
  if (slot == nullptr) {
    ++send_queue_full_;
    return false;
  }
  slot->is_status = true;
  std::memcpy(slot->payload.data(), &status, sizeof status);
  queue_.publish();
  unsent_ = true;
  return true;
}

void NetworkPort::flush() noexcept {
  if (!std::exchange(unsent_, false)) return;
  static_cast<void>(::eventfd_write(wake_.get(), 1) != 0);
}

void NetworkPort::send_until_stopped() noexcept {
  pollfd source{wake_.get(), POLLIN, 0};
  while (true) {
    if (::poll(&source, 1, -1) < 0 && errno != EINTR) return;
    // In this order: what is committed after the queue was seen empty wakes anew.
    eventfd_t seen = 0;
    static_cast<void>(::eventfd_read(wake_.get(), &seen) != 0);
    const bool last = stopping_.load(std::memory_order_acquire);
    send_waiting();
    if (last) return;
  }
}

void NetworkPort::send_waiting() noexcept {
  while (const Slot* const slot = queue_.front()) {
    if (slot->is_status) {
      NodeStatus status;
      std::memcpy(&status, slot->payload.data(), sizeof status);
      static_cast<void>(status_.publish(status, MonotonicClock::now_us()));
    } else {
      static_cast<void>(link_->send(std::span(slot->payload).first(slot->bytes)));
    }
    queue_.pop();
  }
}

}  // namespace tessera
