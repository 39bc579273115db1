// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/network_port.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <cerrno>
#include <cstring>
#include <type_traits>
#include <utility>

#include "base/monotonic_clock.hpp"

namespace tessera {

static_assert(std::is_trivially_copyable_v<NodeState> && sizeof(NodeState) <= kMaxMessageBytes);

NetworkPort::NetworkPort(std::unique_ptr<DatagramLink> link, std::size_t send_slots,
                         const StatusKeys& keys)
    : link_(std::move(link)), status_(*link_, keys), queue_(send_slots) {}

Outcome<std::unique_ptr<NetworkPort>> NetworkPort::open(const LinkConfig& config,
                                                        std::size_t send_slots,
                                                        const ThreadRole& sender,
                                                        const StatusKeys& keys) {
  TESSERA_TRY_ASSIGN(std::unique_ptr<DatagramLink> link, DatagramLink::open(config));
  std::unique_ptr<NetworkPort> port(new NetworkPort(std::move(link), send_slots, keys));
  TESSERA_TRY(port->start(sender));
  return port;
}

Outcome<void> NetworkPort::start(const ThreadRole& role) {
  wake_ = FileDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake_.is_open()) {
    return Failure{std::string("cannot start sending: ") + std::strerror(errno) +
                       "; close other programs, then try again",
                   FailureKind::kFailure};
  }
  return thread_.start(
      role, [](void* port) { static_cast<NetworkPort*>(port)->send_until_stopped(); }, this);
}

void NetworkPort::close() noexcept {
  if (!thread_.is_running()) return;
  stopping_.store(true, std::memory_order_release);
  static_cast<void>(::eventfd_write(wake_.get(), 1) != 0);
  thread_.join();
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

bool NetworkPort::report(const NodeState& status) noexcept {
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
    // In this order: what is committed after the queue was seen empty wakes the thread again.
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
      NodeState status;
      std::memcpy(&status, slot->payload.data(), sizeof status);
      static_cast<void>(status_.publish(status, MonotonicClock::now_us()));
    } else {
      static_cast<void>(link_->send(std::span(slot->payload).first(slot->bytes)));
    }
    queue_.pop();
  }
}

}  // namespace tessera
