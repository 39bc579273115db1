// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot's way to the network that costs its thread no waiting: what arrives is put into a queue
// by the link's thread, what is to be sent is taken from another by a second one. Both queues are
// there from the start.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "lcm/datagram_link.hpp"
#include "lcm/status_publisher.hpp"
#include "posix/file_descriptor.hpp"
#include "posix/outcome.hpp"
#include "posix/spsc_queue.hpp"
#include "posix/thread.hpp"

namespace tessera {

class NetworkPort {
 public:
  /// keys: of statuses; what they point to must outlive the port. Fails as DatagramLink::open. Uses
  /// the heap; nothing after it does.
  static Outcome<std::unique_ptr<NetworkPort>> open(
      const LinkConfig& config, std::size_t send_slots,
      const ThreadRole& sender = {.name = "tessera-send"}, const StatusKeys& keys = {});
  NetworkPort(const NetworkPort&) = delete;
  NetworkPort& operator=(const NetworkPort&) = delete;
  ~NetworkPort() { close(); }

  // --- For the robot's thread alone; none of these waits but wait() ------------------------------

  /// Where the next datagram may be written; empty, and counted, iff the queue is full.
  [[nodiscard]] std::span<std::byte> claim() noexcept;
  /// The first bytes of what claim() gave are to be sent. flush() wakes who does.
  void commit(std::size_t bytes) noexcept;
  /// To be sent as a status message. False, and counted, iff the queue is full.
  bool report(const NodeStatus& status) noexcept;
  void flush() noexcept;
  /// Sends what waits and ends sending, so that the counters are whole.
  void close() noexcept;
  DatagramLink::Received receive(std::span<std::byte, kMaxMessageBytes> into) noexcept {
    return link_->receive(into);
  }
  /// What others say of themselves: the oldest that waits, as DatagramLink::receive_side.
  std::span<const std::byte> receive_status(std::span<std::byte, kMaxMessageBytes> into) noexcept {
    return link_->receive_side(into);
  }
  /// Sleeps until something arrives, timeout_us at most. A signal may wake it too.
  bool wait(std::int64_t timeout_us) noexcept { return link_->wait(timeout_us); }

  /// Times that claim() or report() found no room: more send_slots.
  [[nodiscard]] std::uint64_t send_queue_full() const noexcept { return send_queue_full_; }

  // --- For any thread ----------------------------------------------------------------------------

  [[nodiscard]] const DatagramLink& link() const noexcept { return *link_; }
  [[nodiscard]] std::size_t send_queue_peak() const noexcept { return queue_.peak(); }

 private:
  struct Slot {
    std::uint32_t bytes = 0;
    bool is_status = false;
    alignas(NodeStatus) std::array<std::byte, kMaxMessageBytes> payload{};
  };

  NetworkPort(std::unique_ptr<DatagramLink> link, std::size_t send_slots, const StatusKeys& keys);
  Outcome<void> start(const ThreadRole& role);
  void send_until_stopped() noexcept;
  void send_waiting() noexcept;

  std::unique_ptr<DatagramLink> link_;
  StatusPublisher status_;
  SpscQueue<Slot> queue_;
  FileDescriptor wake_;
  std::atomic<bool> stopping_{false};
  std::uint64_t send_queue_full_ = 0;
  bool unsent_ = false;  ///< Something was committed since the last flush().
  Thread thread_;
};

}  // namespace tessera
