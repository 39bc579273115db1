// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Receives many datagrams with one system call.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "link/short_message.hpp"
#include "link/udpm_sockets.hpp"

namespace tessera {

/// Memory for kMost datagrams: 100 kB. Must not move, as the system gets its addresses.
class DatagramBatch {
 public:
  static constexpr std::size_t kMost = 64;

  DatagramBatch() noexcept;
  DatagramBatch(const DatagramBatch&) = delete;
  DatagramBatch& operator=(const DatagramBatch&) = delete;

  /// Replaces the content by the oldest datagrams that wait at a receiver's socket, and returns
  /// their number; 0 iff none waits or a signal came. One system call, no heap.
  std::size_t receive(int socket) noexcept;

  /// Datagram i, below the result of receive(); dropped is 0 except for the last one.
  [[nodiscard]] UdpmDatagram operator[](std::size_t i) const noexcept;
  [[nodiscard]] std::span<const std::byte> bytes(std::size_t i) const noexcept {
    return std::span(bytes_[i]).first(messages_[i].msg_len);
  }

 private:
  using Control = std::array<std::byte, CMSG_SPACE(sizeof(std::uint32_t))>;

  std::size_t count_ = 0;
  std::array<mmsghdr, kMost> messages_{};
  std::array<iovec, kMost> parts_{};
  std::array<sockaddr_in, kMost> senders_{};
  alignas(cmsghdr) std::array<Control, kMost> controls_{};
  std::array<std::array<std::byte, kMaxUdpPayloadBytes>, kMost> bytes_{};
};

}  // namespace tessera
