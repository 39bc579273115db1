// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Receives from the LCM network of this machine's sensors, whose messages may have megabytes:
// single datagrams of up to 64 kB and fragments, which are assembled here. Only the thread that
// calls receive() waits. After open() nothing uses the heap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "base/file_descriptor.hpp"
#include "base/network_interface.hpp"
#include "base/outcome.hpp"
#include "link/fragment_assembler.hpp"
#include "link/udpm_url.hpp"

namespace tessera {

inline constexpr const char* kDefaultSensorUrl =
    "udpm://239.255.76.68:7668?ttl=0&recv_buf_size=8388608";

struct SensorLinkConfig {
  std::string url = kDefaultSensorUrl;
  std::string interface = "lo";  ///< A name or an IPv4 address; empty: as the routes choose.
  AssemblerConfig assembler{};
};

/// What became of every datagram. None ever decreases.
struct SensorLinkReport {
  std::uint64_t datagrams = 0;
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;        ///< Passed to the sink.
  std::uint64_t malformed = 0;       ///< Not an LCM message: too short, foreign, without a channel.
  std::uint64_t kernel_dropped = 0;  ///< The socket's buffer was full: use a larger recv_buf_size.
  AssemblerReport fragments{};
};

/// Takes what a link receives.
class SensorSink {
 public:
  /// Both are valid only during the call.
  virtual void take(std::string_view channel, std::span<const std::byte> payload) noexcept = 0;

 protected:
  ~SensorSink() = default;
};

class SensorLink {
 public:
  /// Fails with kUsage iff the URL or the interface is invalid, or the URL's ttl is not 0: long
  /// messages must stay on one machine; kFailure iff the system refuses a socket. Uses the heap.
  static Outcome<std::unique_ptr<SensorLink>> open(const SensorLinkConfig& config);

  /// Bytes that a link allocates on the heap.
  [[nodiscard]] static std::size_t required_bytes(const SensorLinkConfig& config) noexcept;

  /// Sleeps until something arrives or wake() is called, at most timeout_us, then takes up to
  /// kBatch datagrams and passes complete messages to the sink. For one thread.
  void receive(std::int64_t timeout_us, SensorSink& sink) noexcept;
  /// Ends a receive() that sleeps, or the next one. For any thread and signal handlers.
  void wake() noexcept;

  /// For the receiving thread.
  [[nodiscard]] SensorLinkReport report() const noexcept;
  [[nodiscard]] const NetworkInterface& interface() const noexcept { return interface_; }
  /// Size granted by the system for recv_buf_size of the URL, including its own overhead.
  [[nodiscard]] int receive_buffer_bytes() const noexcept { return receive_buffer_bytes_; }

 private:
  /// Limits a batch, so that a flood does not block other work of the caller.
  static constexpr int kBatch = 256;

  SensorLink(const SensorLinkConfig& config, NetworkInterface interface);
  /// False iff nothing was waiting.
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
