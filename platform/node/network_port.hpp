// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The network for a robot's thread, without waiting: the link's thread adds what arrives to a
// queue, and a second thread sends what is in another. Both queues are allocated at the start.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/file_descriptor.hpp"
#include "base/outcome.hpp"
#include "base/spsc_queue.hpp"
#include "base/thread.hpp"
#include "link/datagram_link.hpp"
#include "link/status_publisher.hpp"

namespace tessera {

class NetworkPort {
 public:
  /// keys: of statuses; what they point to must outlive the port. Fails as DatagramLink::open. The
  /// only use of the heap.
  static Outcome<std::unique_ptr<NetworkPort>> open(
      const LinkConfig& config, std::size_t send_slots,
      const ThreadRole& sender = {.name = "tessera-send"}, const StatusKeys& keys = {});
  NetworkPort(const NetworkPort&) = delete;
  NetworkPort& operator=(const NetworkPort&) = delete;
  ~NetworkPort() { close(); }

  // --- For the robot's thread only; only wait() waits --------------------------------------------

  /// Memory for the next datagram; empty, and counted, iff the queue is full.
  [[nodiscard]] std::span<std::byte> claim() noexcept;
  /// Queues the first bytes of the memory of claim() for sending. flush() wakes the sending thread.
  void commit(std::size_t bytes) noexcept;
  /// Queues a status message for sending. False, and counted, iff the queue is full.
  bool report(const NodeState& status) noexcept;
  void flush() noexcept;
  /// Sends what waits and ends sending, so that the counters are complete.
  void close() noexcept;
  DatagramLink::Received receive(std::span<std::byte, kMaxMessageBytes> into) noexcept {
    return link_->receive(into);
  }
  /// Statuses of other robots: the oldest that waits, as DatagramLink::receive_side.
  std::span<const std::byte> receive_status(std::span<std::byte, kMaxMessageBytes> into) noexcept {
    return link_->receive_side(into);
  }
  /// Sleeps until something arrives, at most timeout_us. A signal may wake it too.
  bool wait(std::int64_t timeout_us) noexcept { return link_->wait(timeout_us); }

  /// Number of calls of claim() or report() without room: configure more send_slots.
  [[nodiscard]] std::uint64_t send_queue_full() const noexcept { return send_queue_full_; }

  // --- For any thread ----------------------------------------------------------------------------

  [[nodiscard]] const DatagramLink& link() const noexcept { return *link_; }
  [[nodiscard]] std::size_t send_queue_peak() const noexcept { return queue_.peak(); }

 private:
  struct Slot {
    std::uint32_t bytes = 0;
    bool is_status = false;
    alignas(NodeState) std::array<std::byte, kMaxMessageBytes> payload{};
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
