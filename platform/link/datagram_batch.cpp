// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/datagram_batch.hpp"

namespace tessera {

// Each element of the array begins where a cmsghdr may.
static_assert(CMSG_SPACE(sizeof(std::uint32_t)) % alignof(cmsghdr) == 0);

DatagramBatch::DatagramBatch() noexcept {
  for (std::size_t i = 0; i < kMost; ++i) {
    parts_[i] = {bytes_[i].data(), bytes_[i].size()};
    msghdr& message = messages_[i].msg_hdr;
    message.msg_name = &senders_[i];
    message.msg_iov = &parts_[i];
    message.msg_iovlen = 1;
    message.msg_control = controls_[i].data();
  }
}

std::size_t DatagramBatch::receive(int socket) noexcept {
  for (mmsghdr& one : messages_) {
    one.msg_hdr.msg_namelen = sizeof(sockaddr_in);
    one.msg_hdr.msg_controllen = sizeof(Control);
  }
  const int count = ::recvmmsg(socket, messages_.data(), kMost, 0, nullptr);
  count_ = count < 0 ? 0 : static_cast<std::size_t>(count);
  return count_;
}

UdpmDatagram DatagramBatch::operator[](std::size_t i) const noexcept {
  const msghdr& message = messages_[i].msg_hdr;
  return {.read = UdpmDatagram::Read::kTaken,
          .bytes = messages_[i].msg_len,
          .is_cut = (message.msg_flags & MSG_TRUNC) != 0,
          .sender = {ntohl(senders_[i].sin_addr.s_addr), ntohs(senders_[i].sin_port)},
          .dropped = i + 1 == count_ ? dropped_by_kernel(message) : 0};
}

}  // namespace tessera
