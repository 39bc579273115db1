// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/sensor_sender.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "link/udpm_sockets.hpp"

namespace tessera {

Outcome<std::unique_ptr<SensorSender>> SensorSender::open(const std::string& text,
                                                          const std::string& name) {
  TESSERA_TRY_ASSIGN(const UdpmUrl url, UdpmUrl::parse(text));
  if (url.ttl != 0) {
    return Failure{"cannot use the LCM URL " + one_line(text) +
                   " for sensors: their messages may have megabytes and must not leave the "
                   "machine; write ttl=0"};
  }
  TESSERA_TRY_ASSIGN(const NetworkInterface interface, udpm_interface(name, url));
  TESSERA_TRY_ASSIGN(UdpmSender sender, open_udpm_sender({url, text, interface}, false));
  return std::unique_ptr<SensorSender>(new SensorSender(std::move(sender.socket)));
}

bool SensorSender::send_datagram(std::span<const std::byte> header,
                                 std::span<const std::byte> payload) noexcept {
  // sendmsg only reads them, although its type is not const.
  iovec parts[] = {{const_cast<std::byte*>(header.data()), header.size()},
                   {const_cast<std::byte*>(payload.data()), payload.size()}};
  msghdr message{};
  message.msg_iov = parts;
  message.msg_iovlen = 2;
  // Its buffer empties as receivers' are filled, so it waits for a full one: at most 100 ms.
  constexpr int kTries = 10;
  for (int i = 0; i < kTries; ++i) {
    const ssize_t sent = ::sendmsg(socket_.get(), &message, MSG_NOSIGNAL);
    if (sent >= 0) return true;
    if (errno != EINTR && errno != EAGAIN && errno != EWOULDBLOCK && errno != ENOBUFS) return false;
    pollfd ready{socket_.get(), POLLOUT, 0};
    static_cast<void>(!::poll(&ready, 1, 10));
  }
  return false;
}

bool SensorSender::send(std::string_view channel, std::span<const std::byte> message) noexcept {
  const bool is_channel = !channel.empty() && channel.size() <= kMaxChannelBytes;
  if (!is_channel || message.empty() || message.size() > kFragmentBytes * 65'535) return false;
  bool sent = false;
  if (channel.size() + 1 + message.size() <= kMostWholeBytes) {
    ShortHeader header;
    const std::size_t bytes = write_header(header, sequence_, channel);
    sent = send_datagram(std::span(header).first(bytes), message);
  } else {
    sent = send_fragments(channel, message);
  }
  ++sequence_;
  if (!sent) return false;
  ++messages_;
  bytes_ += message.size();
  return true;
}

bool SensorSender::send_fragments(std::string_view channel,
                                  std::span<const std::byte> message) noexcept {
  const std::size_t total = channel.size() + 1 + message.size();
  Fragment fragment;
  fragment.sequence = sequence_;
  fragment.message_bytes = static_cast<std::uint32_t>(message.size());
  fragment.fragments = static_cast<std::uint16_t>((total + kFragmentBytes - 1) / kFragmentBytes);
  fragment.channel = channel;
  std::size_t offset = 0;
  for (std::uint32_t number = 0; number < fragment.fragments; ++number) {
    const std::size_t room = kFragmentBytes - (number == 0 ? channel.size() + 1 : 0);
    const std::size_t bytes = std::min(room, message.size() - offset);
    fragment.number = static_cast<std::uint16_t>(number);
    fragment.offset = static_cast<std::uint32_t>(offset);
    FragmentHeader header;
    const std::size_t header_bytes = write_fragment_header(header, fragment);
    if (!send_datagram(std::span(header).first(header_bytes), message.subspan(offset, bytes)))
      return false;
    offset += bytes;
    if (number % kBurstFragments == kBurstFragments - 1) {
      const timespec pause{0, kPause_us * 1'000};
      ::nanosleep(&pause, nullptr);
    }
  }
  return true;
}

}  // namespace tessera
