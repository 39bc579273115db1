// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/service_notice.hpp"

#include <sys/socket.h>

#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace tessera {

namespace {

std::optional<std::int64_t> number_of(const char* text) {
  if (text == nullptr) return {};
  std::int64_t number = 0;
  const char* const end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, number);
  if (error != std::errc() || stop != end || number <= 0) return {};
  return number;
}

}  // namespace

ServiceNotice::ServiceNotice() {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  if (path == nullptr || (path[0] != '/' && path[0] != '@')) return;
  const std::size_t length = std::strlen(path);
  if (length >= sizeof address_.sun_path) return;
  address_.sun_family = AF_UNIX;
  std::memcpy(address_.sun_path, path, length);
  // An abstract name, without a file, begins with a zero.
  if (path[0] == '@') address_.sun_path[0] = '\0';
  address_bytes_ = static_cast<unsigned>(offsetof(sockaddr_un, sun_path) + length);
  socket_ = FileDescriptor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const std::optional<std::int64_t> process = number_of(std::getenv("WATCHDOG_PID"));
  if (!process || *process == ::getpid()) watchdog_us_ = number_of(std::getenv("WATCHDOG_USEC"));
}

void ServiceNotice::tell(std::string_view state) noexcept {
  if (!is_heard()) return;
  static_cast<void>(::sendto(socket_.get(), state.data(), state.size(), MSG_NOSIGNAL,
                             reinterpret_cast<const sockaddr*>(&address_), address_bytes_));
}

}  // namespace tessera
