// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// flood KIND BYTES RATE SECONDS: sends packets that no robot of a fleet with a key has sent to the
// robots' group, by the loopback interface alone (ttl 0), and prints what it sent as JSON. For
// bench/onboard/flood.py, which runs it in a network of its own.
#include <arpa/inet.h>
#include <sys/socket.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <thread>

#include "base/file_descriptor.hpp"
#include "base/monotonic_clock.hpp"
#include "link/short_message.hpp"
#include "link/udpm_url.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kMostRate = 200'000;
constexpr std::int64_t kMostSeconds = 60;
constexpr std::size_t kBatch = 32;

struct Flood {
  std::string_view kind;  ///< "forged": only the tag is wrong. "fragments": of long LCM messages.
  std::size_t bytes = 0;  ///< Of UDP payload.
  std::int64_t per_s = 0;
  std::int64_t duration_us = 0;
};

using Packet = std::array<std::byte, kMaxUdpPayloadBytes>;

Packet packet_of(const Flood& flood) {
  Packet packet;
  std::uint32_t noise = 1;
  for (std::byte& byte : packet) {
    noise = noise * 1664525U + 1013904223U;
    byte = static_cast<std::byte>(noise >> 24U);
  }
  if (flood.kind == "fragments") {
    std::memcpy(packet.data(), "LC03", 4);
    return packet;
  }
  ShortHeader header;
  const std::size_t begin = write_header(header, 0, "TESSERA");
  std::memcpy(packet.data(), header.data(), begin);
  const std::span<std::byte> body = std::span(packet).subspan(begin, kHeaderBytes);
  ByteWriter writer(body);
  write_header(writer, {.kind = DatagramKind::kChunk, .sender = 1, .session = 1, .sequence = 1});
  return packet;
}

FileDescriptor connected_socket() {
  FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const in_addr loopback{htonl(INADDR_LOOPBACK)};
  const int ttl = 0;
  UdpmUrl url = *UdpmUrl::parse(kDefaultUrl);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(url.port);
  to.sin_addr.s_addr = htonl(url.group);
  const bool ready =
      ::setsockopt(socket.get(), IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback) == 0 &&
      ::setsockopt(socket.get(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl) == 0 &&
      ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  return ready ? std::move(socket) : FileDescriptor();
}

/// In batches, each when it is due; returns how many were sent.
std::int64_t send_all(int socket, const Flood& flood) {
  Packet packet = packet_of(flood);
  iovec part{packet.data(), flood.bytes};
  std::array<mmsghdr, kBatch> batch{};
  for (mmsghdr& one : batch) {
    one.msg_hdr.msg_iov = &part;
    one.msg_hdr.msg_iovlen = 1;
  }
  const std::int64_t start_us = MonotonicClock::now_us();
  std::int64_t sent = 0;
  while (true) {
    const std::int64_t passed_us = MonotonicClock::now_us() - start_us;
    if (passed_us >= flood.duration_us) return sent;
    const std::int64_t due = passed_us * flood.per_s / 1'000'000 - sent;
    if (due < static_cast<std::int64_t>(kBatch)) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      continue;
    }
    const int count = ::sendmmsg(socket, batch.data(), kBatch, 0);
    if (count > 0) sent += count;
  }
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  using namespace tessera;
  Flood flood;
  if (argc == 5) {
    flood = {argv[1], std::strtoul(argv[2], nullptr, 10), std::strtol(argv[3], nullptr, 10),
             1'000'000 * std::strtol(argv[4], nullptr, 10)};
  }
  const bool known = flood.kind == "forged" || flood.kind == "fragments";
  if (!known || flood.bytes < 60 || flood.bytes > kMaxUdpPayloadBytes || flood.per_s < 1 ||
      flood.per_s > kMostRate || flood.duration_us < 1 ||
      flood.duration_us > 1'000'000 * kMostSeconds) {
    std::fputs("flood forged|fragments BYTES(60..1408) RATE(1..200000) SECONDS(1..60)\n", stderr);
    return 1;
  }
  const FileDescriptor socket = connected_socket();
  if (!socket.is_open()) {
    std::perror("flood");
    return 2;
  }
  const std::int64_t start_us = MonotonicClock::now_us();
  const std::int64_t sent = send_all(socket.get(), flood);
  const double seconds = 1e-6 * static_cast<double>(MonotonicClock::now_us() - start_us);
  std::printf("{\"sent\": %lld, \"per_s\": %.0f}\n", static_cast<long long>(sent),
              static_cast<double>(sent) / seconds);
  return 0;
}
