// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Hears the LCM network of the machine's own sensors, whose messages may have megabytes: whole
// datagrams of up to 64 kB and fragments, which are put together here. The one thread that calls
// receive() waits in it; nobody else ever waits for it. After open() nothing uses the heap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "lcm/fragment_assembler.hpp"
#include "lcm/udpm_url.hpp"
#include "posix/file_descriptor.hpp"
#include "posix/network_interface.hpp"
#include "posix/outcome.hpp"

namespace tessera {

inline constexpr const char* kDefaultSensorUrl =
    "udpm://239.255.76.68:7668?ttl=0&recv_buf_size=8388608";

struct SensorLinkConfig {
  std::string url = kDefaultSensorUrl;
  std::string interface = "lo";  ///< A name or an IPv4 address; empty: what the routes choose.
  AssemblerConfig assembler{};
};

/// What became of every datagram. None ever decreases.
struct SensorLinkReport {
  std::uint64_t datagrams = 0;
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;        ///< Handed to the sink.
  std::uint64_t malformed = 0;       ///< No LCM message: too short, foreign, without a channel.
  std::uint64_t kernel_dropped = 0;  ///< The socket's buffer was full: a larger recv_buf_size.
  AssemblerReport fragments{};
};

/// Takes what a link hears.
class SensorSink {
 public:
  /// Both are of use during the call only.
  virtual void take(std::string_view channel, std::span<const std::byte> payload) noexcept = 0;

 protected:
  ~SensorSink() = default;
};

class SensorLink {
 public:
  /// Fails with kUsage iff the URL or the interface is none, or the URL's ttl is not 0: long
  /// messages are for one machine; kFailure iff the system refuses a socket. Uses the heap.
  static Outcome<std::unique_ptr<SensorLink>> open(const SensorLinkConfig& config);

  /// Bytes of memory that a link takes from the heap.
  [[nodiscard]] static std::size_t required_bytes(const SensorLinkConfig& config) noexcept;

  /// Sleeps until something comes or wake() is called, timeout_us at most, then takes up to kBatch
  /// datagrams and hands whole messages to the sink. For one thread.
  void receive(std::int64_t timeout_us, SensorSink& sink) noexcept;
  /// Ends a receive() that sleeps, or the next one. For any thread and signal handlers.
  void wake() noexcept;

  /// For the thread that receives.
  [[nodiscard]] SensorLinkReport report() const noexcept;
  [[nodiscard]] const NetworkInterface& interface() const noexcept { return interface_; }
  /// What the system granted of the URL's recv_buf_size, which it counts with its own overhead.
  [[nodiscard]] int receive_buffer_bytes() const noexcept { return receive_buffer_bytes_; }

 private:
  /// So that a flood does not keep the caller from its other work.
  static constexpr int kBatch = 256;

  SensorLink(const SensorLinkConfig& config, NetworkInterface interface);
  /// False iff nothing was there.
  bool receive_one(SensorSink& sink) noexcept;
  void take(std::span<const std::byte> datagram, const Endpoint& sender, SensorSink& sink) noexcept;

  NetworkInterface interface_;
  int receive_buffer_bytes_ = 0;
  FileDescriptor receiver_;
  FileDescriptor wake_;
  FragmentAssembler assembler_;
  SensorLinkReport report_;
  std::array<std::byte, 65'536> datagram_{};
};

}  // namespace tessera
