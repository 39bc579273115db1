// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/datagram_link.hpp"

#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/monotonic_clock.hpp"
#include "link/udpm_sockets.hpp"

namespace tessera {
namespace {

bool is_channel(std::string_view channel) {
  return !channel.empty() && channel.size() <= kMaxChannelBytes &&
         std::all_of(channel.begin(), channel.end(), [](char c) { return c > ' ' && c < '\x7f'; });
}

/// CPU time of the calling thread, in microseconds.
std::int64_t thread_cpu_us() noexcept {
  timespec used{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return std::int64_t{used.tv_sec} * 1'000'000 + std::int64_t{used.tv_nsec} / 1'000;
}

}  // namespace

DatagramLink::DatagramLink(LinkConfig config, const UdpmUrl& url, NetworkInterface interface)
    : config_(std::move(config)),
      url_(url),
      interface_(std::move(interface)),
      queue_(config_.queue_slots),
      side_(config_.side) {}

DatagramLink::~DatagramLink() {
  if (!thread_.is_running()) return;
  // An eventfd always accepts a first number.
  static_cast<void>(!::eventfd_write(stop_.get(), 1));
  thread_.join();
}

Outcome<std::unique_ptr<DatagramLink>> DatagramLink::open(const LinkConfig& config) {
  TESSERA_TRY_ASSIGN(const UdpmUrl url, UdpmUrl::parse(config.url));
  if (!is_channel(config.channel)) {
    return Failure{"cannot use the LCM channel \"" + config.channel +
                   "\"; choose 1 to 63 letters, digits and signs"};
  }
  TESSERA_TRY_ASSIGN(const NetworkInterface interface, udpm_interface(config.interface, url));
  std::unique_ptr<DatagramLink> link(new DatagramLink(config, url, interface));
  for (const auto step : {&DatagramLink::open_sockets, &DatagramLink::start}) {
    TESSERA_TRY(((*link).*step)());
  }
  return link;
}

Outcome<void> DatagramLink::open_sockets() {
  const UdpmPlace place{url_, config_.url, interface_};
  TESSERA_TRY_ASSIGN(UdpmSender sender, open_udpm_sender(place, true));
  // The buffer holds what arrives while the thread pauses.
  TESSERA_TRY_ASSIGN(UdpmReceiver receiver, open_udpm_receiver(place, true));
  sender_ = std::move(sender.socket);
  self_ = sender.self;
  receiver_ = std::move(receiver.socket);
  receive_buffer_bytes_ = receiver.buffer_bytes;
  return {};
}

Outcome<void> DatagramLink::start() {
  stop_ = FileDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  arrived_ = FileDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!stop_.is_open() || !arrived_.is_open()) {
    return Failure{std::string("cannot start receiving: ") + std::strerror(errno) +
                       "; close other programs, then try again",
                   FailureKind::kFailure};
  }
  return thread_.start(
      config_.thread, [](void* link) { static_cast<DatagramLink*>(link)->receive_until_stopped(); },
      this);
}

bool DatagramLink::send(std::span<const std::byte> payload) noexcept {
  return send_on(config_.channel, payload);
}

bool DatagramLink::send_on(std::string_view channel, std::span<const std::byte> payload) noexcept {
  const bool fits = !channel.empty() && channel.size() <= kMaxChannelBytes && !payload.empty() &&
                    payload.size() <= kMaxMessageBytes - channel.size() - 1;
  if (!fits) {
    LinkCounters::add(counters_.refused);
    return false;
  }
  ShortHeader header;
  const std::uint32_t sequence = sequence_.fetch_add(1, std::memory_order_relaxed);
  const std::size_t header_bytes = write_header(header, sequence, channel);
  // sendmsg only reads payload, although its type is not const.
  iovec parts[] = {{header.data(), header_bytes},
                   {const_cast<std::byte*>(payload.data()), payload.size()}};
  msghdr message{};
  message.msg_iov = parts;
  message.msg_iovlen = 2;
  ssize_t sent = -1;
  do {
    sent = ::sendmsg(sender_.get(), &message, MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  if (sent < 0) {
    LinkCounters::add(counters_.failed);
    return false;
  }
  LinkCounters::add(counters_.sent);
  LinkCounters::add(counters_.sent_bytes, payload.size());
  return true;
}

void DatagramLink::receive_until_stopped() noexcept {
  pollfd sources[] = {{receiver_.get(), POLLIN, 0}, {stop_.get(), POLLIN, 0}};
  std::int64_t paused_at_us = thread_cpu_us();
  while (true) {
    if (::poll(sources, 2, -1) < 0 && errno != EINTR) return;
    if (sources[1].revents != 0) return;
    // A bounded number, so that a flood neither prevents the link from stopping nor delays its
    // reader.
    constexpr std::size_t kMostAtOnce = 4 * DatagramBatch::kMost;
    const std::uint64_t before = counters_.received.load(std::memory_order_relaxed);
    std::size_t taken = 0;
    for (std::size_t last = DatagramBatch::kMost;
         last == DatagramBatch::kMost && taken < kMostAtOnce;) {
      last = receive_batch();
      taken += last;
    }
    if (counters_.received.load(std::memory_order_relaxed) != before)
      static_cast<void>(!::eventfd_write(arrived_.get(), 1));
    // Including poll and the wake-up, so that the pause is at least as long as all work before it.
    const std::int64_t worked_us = thread_cpu_us() - paused_at_us;
    const std::int64_t pause_us =
        pace_.pause_us(static_cast<std::int64_t>(taken), worked_us, MonotonicClock::now_us());
    if (!pause(pause_us)) return;
    paused_at_us += worked_us;
  }
}

bool DatagramLink::pause(std::int64_t duration_us) const noexcept {
  if (duration_us == 0) return true;
  pollfd stop{stop_.get(), POLLIN, 0};
  const timespec duration{duration_us / 1'000'000, duration_us % 1'000'000 * 1'000};
  return ::ppoll(&stop, 1, &duration, nullptr) <= 0;
}

std::size_t DatagramLink::receive_batch() noexcept {
  const std::size_t count = batch_.receive(receiver_.get());
  for (std::size_t i = 0; i < count; ++i) {
    const UdpmDatagram datagram = batch_[i];
    if (datagram.dropped != 0)
      counters_.kernel_dropped.store(datagram.dropped, std::memory_order_relaxed);
    if (datagram.is_cut) {
      LinkCounters::add(counters_.too_long);
    } else {
      take(batch_.bytes(i), datagram.sender);
    }
  }
  return count;
}

void DatagramLink::take(std::span<const std::byte> datagram, const Endpoint& sender) noexcept {
  if (sender == self_ && !config_.hear_itself) return LinkCounters::add(counters_.own);
  const ReceivedMessage message = read_message(datagram);
  switch (message.kind) {
    case MessageKind::kTooShort:
      return LinkCounters::add(counters_.too_short);
    case MessageKind::kTooLong:
      return LinkCounters::add(counters_.too_long);
    case MessageKind::kForeign:
      return LinkCounters::add(counters_.foreign);
    case MessageKind::kNoChannel:
      return LinkCounters::add(counters_.no_channel);
    case MessageKind::kFragment:
    case MessageKind::kShort:
      break;
  }
  const bool is_fragment = message.kind == MessageKind::kFragment;
  if (!is_fragment && message.channel == config_.channel && !message.payload.empty())
    return take_payload(message, sender);
  if (!is_fragment && side_.is_for(message.channel)) {
    // Its messages are numbered in the same sequence.
    if (side_.take(message.payload))
      LinkCounters::add(counters_.missing, senders_.missing_if_known(sender, message.sequence));
    return;
  }
  LinkCounters::add(counters_.missing, senders_.missing_if_known(sender, message.sequence));
  if (is_fragment) return LinkCounters::add(counters_.fragments);
  if (message.channel != config_.channel) return LinkCounters::add(counters_.other_channel);
  LinkCounters::add(counters_.too_short);
}

void DatagramLink::take_payload(const ReceivedMessage& message, const Endpoint& sender) noexcept {
  const PayloadCheck& check = config_.check;
  const PayloadVerdict verdict =
      check.check == nullptr ? PayloadVerdict::kTaken : check.check(check.context, message.payload);
  switch (verdict) {
    case PayloadVerdict::kFormat:
      return LinkCounters::add(counters_.refused_format);
    case PayloadVerdict::kMission:
      return LinkCounters::add(counters_.refused_mission);
    case PayloadVerdict::kTag:
      return LinkCounters::add(counters_.refused_tag);
    case PayloadVerdict::kExcluded:
      return LinkCounters::add(counters_.refused_excluded);
    case PayloadVerdict::kTaken:
      break;
  }
  // Only now, so that refused datagrams take no place of a sender and count no number as missing.
  LinkCounters::add(counters_.missing, senders_.missing_before(sender, message.sequence));
  queue(message, sender);
}

void DatagramLink::queue(const ReceivedMessage& message, const Endpoint& sender) noexcept {
  Slot* const slot = queue_.claim();
  if (slot == nullptr) return LinkCounters::add(counters_.queue_full);
  slot->sender = sender;
  slot->bytes = static_cast<std::uint32_t>(message.payload.size());
  std::copy(message.payload.begin(), message.payload.end(), slot->payload.begin());
  queue_.publish();
  LinkCounters::add(counters_.received);
  LinkCounters::add(counters_.received_bytes, message.payload.size());
}

DatagramLink::Received DatagramLink::receive(std::span<std::byte, kMaxMessageBytes> into) noexcept {
  const Slot* const slot = queue_.front();
  if (slot == nullptr) return {};
  std::copy_n(slot->payload.begin(), slot->bytes, into.begin());
  const Received received{into.first(slot->bytes), slot->sender};
  queue_.pop();
  return received;
}

bool DatagramLink::wait(std::int64_t timeout_us) noexcept {
  // In this order: what arrives after the queue was seen empty is counted again.
  eventfd_t seen = 0;
  static_cast<void>(!::eventfd_read(arrived_.get(), &seen));
  if (queue_.front() != nullptr) return true;
  if (timeout_us <= 0) return false;
  pollfd source{arrived_.get(), POLLIN, 0};
  const timespec timeout{timeout_us / 1'000'000, timeout_us % 1'000'000 * 1'000};
  static_cast<void>(!::ppoll(&source, 1, &timeout, nullptr));
  return queue_.front() != nullptr;
}

LinkReport DatagramLink::report() const noexcept {
  LinkReport report = counters_.report();
  report.queue_peak = queue_.peak();
  return report;
}

}  // namespace tessera
