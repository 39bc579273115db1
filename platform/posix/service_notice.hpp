// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a service tells the service manager that started it: that it is ready, how it does, that it
// is alive, that it ends. In systemd's protocol (sd_notify(3)), text in a datagram to the socket
// that NOTIFY_SOCKET names; libsystemd's function takes memory from the heap for each.
#pragma once

#include <sys/un.h>

#include <cstdint>
#include <optional>
#include <string_view>

#include "posix/file_descriptor.hpp"

namespace tessera {

class ServiceNotice {
 public:
  /// Takes what the environment says. Without a service manager nothing is told to anybody.
  ServiceNotice();

  /// Whether there is one that listens.
  [[nodiscard]] bool is_heard() const noexcept { return socket_.is_open(); }
  /// Within which it wants to hear that this program is alive, microseconds; none: it does not.
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
