// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/sensor_link.hpp"

#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/monotonic_clock.hpp"
#include "link/udpm_sockets.hpp"

namespace tessera {

SensorLink::SensorLink(const SensorLinkConfig& config, NetworkInterface interface)
    : interface_(std::move(interface)), assembler_(config.assembler) {}

std::size_t SensorLink::required_bytes(const SensorLinkConfig& config) noexcept {
  return sizeof(SensorLink) + FragmentAssembler::required_bytes(config.assembler);
}

Outcome<std::unique_ptr<SensorLink>> SensorLink::open(const SensorLinkConfig& config) {
  TESSERA_TRY_ASSIGN(const UdpmUrl url, UdpmUrl::parse(config.url));
  if (url.ttl != 0) {
    return Failure{"cannot use the LCM URL " + one_line(config.url) +
                   " for sensors: their messages may have megabytes and must not leave the "
                   "machine; write ttl=0"};
  }
  TESSERA_TRY_ASSIGN(const NetworkInterface interface, udpm_interface(config.interface, url));
  TESSERA_TRY_ASSIGN(UdpmReceiver receiver, open_udpm_receiver({url, config.url, interface}, true));
  FileDescriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake.is_open()) {
    return Failure{"cannot start receiving: no file descriptor is left; close other programs",
                   FailureKind::kFailure};
  }
  std::unique_ptr<SensorLink> link(new SensorLink(config, interface));
  link->receiver_ = std::move(receiver.socket);
  link->receive_buffer_bytes_ = receiver.buffer_bytes;
  link->wake_ = std::move(wake);
  return link;
}

void SensorLink::wake() noexcept { static_cast<void>(!::eventfd_write(wake_.get(), 1)); }

void SensorLink::receive(std::int64_t timeout_us, SensorSink& sink) noexcept {
  pollfd sources[] = {{receiver_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}};
  const std::int64_t wait_us = std::max<std::int64_t>(timeout_us, 0);
  const timespec timeout{wait_us / 1'000'000, wait_us % 1'000'000 * 1'000};
  if (::ppoll(sources, 2, &timeout, nullptr) <= 0) return;
  if (sources[1].revents != 0) {
    eventfd_t seen = 0;
    static_cast<void>(!::eventfd_read(wake_.get(), &seen));
  }
  for (int i = 0; i < kBatch && receive_one(sink); ++i) {
  }
}

bool SensorLink::receive_one(SensorSink& sink) noexcept {
  const UdpmDatagram datagram = receive_datagram(receiver_.get(), datagram_);
  if (datagram.read != UdpmDatagram::Read::kTaken)
    return datagram.read == UdpmDatagram::Read::kInterrupted;
  if (datagram.dropped != 0) report_.kernel_dropped = datagram.dropped;
  ++report_.datagrams;
  report_.bytes += datagram.bytes;
  take(std::span<const std::byte>(datagram_).first(datagram.bytes), datagram.sender, sink);
  return true;
}

void SensorLink::take(std::span<const std::byte> datagram, const Endpoint& sender,
                      SensorSink& sink) noexcept {
  const bool is_fragment = datagram.size() >= kShortHeaderBytes &&
                           detail::read_big_endian(datagram) == detail::kFragmentMagic;
  if (is_fragment) {
    const FragmentAssembler::Message message =
        assembler_.take(sender, datagram, MonotonicClock::now_us());
    if (message.channel.empty()) return;
    ++report_.messages;
    return sink.take(message.channel, message.payload);
  }
  const ReceivedMessage message = read_whole_message(datagram);
  if (message.kind != MessageKind::kShort) {
    ++report_.malformed;
    return;
  }
  ++report_.messages;
  sink.take(message.channel, message.payload);
}

SensorLinkReport SensorLink::report() const noexcept {
  SensorLinkReport report = report_;
  report.fragments = assembler_.report();
  return report;
}

}  // namespace tessera
