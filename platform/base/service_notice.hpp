// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Notifies the service manager: readiness, status, watchdog, stop. In systemd's protocol
// (sd_notify(3)), text in a datagram to the socket in NOTIFY_SOCKET; libsystemd's function would
// allocate memory for each.
#pragma once

#include <sys/un.h>

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/file_descriptor.hpp"

namespace tessera {

class ServiceNotice {
 public:
  /// Reads the environment. Without a service manager nothing is sent.
  ServiceNotice();

  /// True if there is a service manager.
  [[nodiscard]] bool is_heard() const noexcept { return socket_.is_open(); }
  /// Period of its watchdog, microseconds; none: it has no watchdog.
  [[nodiscard]] std::optional<std::int64_t> watchdog_us() const noexcept { return watchdog_us_; }
  /// "READY=1", "WATCHDOG=1", "STOPPING=1", "STATUS=..."; lines of them. Never waits; what cannot
  /// be sent is lost. No heap.
  void tell(std::string_view state) noexcept;

 private:
  FileDescriptor socket_;
  sockaddr_un address_{};
  unsigned address_bytes_ = 0;
  std::optional<std::int64_t> watchdog_us_;
};

}  // namespace tessera
