// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Datagrams to and from every robot of an LCM network, in the wire format of LCM's short messages,
// so that lcm-logger, lcm-logplayer and lcm-spy can receive and send them. Does not use liblcm,
// which assembles fragments before they can be refused, allocates while it receives, and does not
// report the sender. Here a fragment is counted and dropped by its first four bytes, and after
// open() neither sending nor receiving uses the heap.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "base/file_descriptor.hpp"
#include "base/network_interface.hpp"
#include "base/outcome.hpp"
#include "base/spsc_queue.hpp"
#include "base/thread.hpp"
#include "link/datagram_batch.hpp"
#include "link/link_report.hpp"
#include "link/receive_pace.hpp"
#include "link/sender_table.hpp"
#include "link/short_message.hpp"
#include "link/side_intake.hpp"
#include "link/udpm_url.hpp"

namespace tessera {

struct LinkConfig {
  std::string url = kDefaultUrl;
  std::string channel = "TESSERA";  ///< 1 to 63 bytes, printable ASCII without space.
  std::string interface = {};       ///< A name or an IPv4 address; empty: as the routes choose.
  std::size_t queue_slots = 4096;   ///< 1,412 bytes each; rounded up to a power of two, up to 2^20.
  bool hear_itself = false;         ///< Whether receive() also returns what send() sent.
  ThreadRole thread{.name = "tessera-link"};  ///< Of the receiving thread.
  PayloadCheck check{};
  SideChannel side{};
};

class DatagramLink {
 public:
  struct Received {
    std::span<const std::byte> bytes{};  ///< Empty: none was waiting.
    Endpoint sender{};                   ///< From the network, so it can be forged.
  };

  /// Opens the sockets and starts the thread that receives. Fails with kUsage iff the URL, the
  /// channel or the interface is invalid; kFailure iff there is no route to the group and no
  /// interface is named, or the system refuses a socket or the thread. Uses the heap.
  static Outcome<std::unique_ptr<DatagramLink>> open(const LinkConfig& config);

  DatagramLink(const DatagramLink&) = delete;
  DatagramLink& operator=(const DatagramLink&) = delete;
  /// Stops the thread, which takes at most as long as a batch of datagrams.
  ~DatagramLink();

  /// Payload bytes that fit into a message of the channel.
  [[nodiscard]] std::size_t max_payload_bytes() const noexcept {
    return kMaxMessageBytes - config_.channel.size() - 1;
  }
  /// Sends payload on the link's channel. False, and counted, iff it is empty or longer than
  /// max_payload_bytes(), or the system refuses it (its buffer is full, no network, longer than the
  /// interface's MTU). Never waits, never sends a part. For any thread.
  bool send(std::span<const std::byte> payload) noexcept;
  /// As send(), on another channel (1 to 63 bytes without a zero, else it is refused): for typed
  /// messages to tools.
  bool send_on(std::string_view channel, std::span<const std::byte> payload) noexcept;

  /// Copies the oldest datagram that waits to into. Never waits. For one thread only.
  Received receive(std::span<std::byte, kMaxMessageBytes> into) noexcept;

  /// As receive(), for the side channel. Its datagrams wake no thread, and wait() ignores them.
  std::span<const std::byte> receive_side(std::span<std::byte, kMaxMessageBytes> into) noexcept {
    return side_.receive(into);
  }

  /// Sleeps until a datagram waits, at most timeout_us; returns whether one does. timeout_us:
  /// microseconds, at most 0: does not sleep. For the receiving thread.
  bool wait(std::int64_t timeout_us) noexcept;

  /// Counters of all threads; each number is exact, and all are of about the same moment.
  [[nodiscard]] LinkReport report() const noexcept;
  [[nodiscard]] SideReport side_report() const noexcept { return side_.report(); }
  [[nodiscard]] const NetworkInterface& interface() const noexcept { return interface_; }
  /// Size granted by the system for recv_buf_size of the URL, including its own overhead.
  [[nodiscard]] int receive_buffer_bytes() const noexcept { return receive_buffer_bytes_; }

 private:
  struct Slot {
    Endpoint sender{};
    std::uint32_t bytes = 0;
    std::array<std::byte, kMaxMessageBytes> payload{};
  };

  DatagramLink(LinkConfig config, const UdpmUrl& url, NetworkInterface interface);
  Outcome<void> open_sockets();
  Outcome<void> start();
  void receive_until_stopped() noexcept;
  /// Takes up to a batch of waiting datagrams; returns their number.
  std::size_t receive_batch() noexcept;
  /// False iff the link must stop.
  [[nodiscard]] bool pause(std::int64_t duration_us) const noexcept;
  void take(std::span<const std::byte> datagram, const Endpoint& sender) noexcept;
  void take_payload(const ReceivedMessage& message, const Endpoint& sender) noexcept;
  void queue(const ReceivedMessage& message, const Endpoint& sender) noexcept;

  const LinkConfig config_;
  const UdpmUrl url_;
  const NetworkInterface interface_;
  int receive_buffer_bytes_ = 0;
  FileDescriptor sender_;
  FileDescriptor receiver_;
  FileDescriptor stop_;
  FileDescriptor arrived_;  ///< Counts batches from which something was queued.
  Endpoint self_{};
  std::atomic<std::uint32_t> sequence_{0};
  SpscQueue<Slot> queue_;
  SideIntake side_;
  SenderTable senders_;
  DatagramBatch batch_;
  ReceivePace pace_;
  LinkCounters counters_;
  Thread thread_;
};

}  // namespace tessera
