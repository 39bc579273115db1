// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <time.h>
#include <unistd.h>

#include <memory>

#include "base/monotonic_clock.hpp"
#include "base/network_interface.hpp"
#include "cli/doctor.hpp"
#include "link/datagram_link.hpp"

namespace tessera {
namespace {

constexpr int kEchoes = 20;
constexpr std::int64_t kEchoTimeout_us = 1'000'000;
constexpr std::int64_t kEchoStep_us = 1'000;

Check check_url(const Outcome<UdpmUrl>& url) {
  const char* const needed = "udpm://GROUP:PORT?ttl=N";
  if (!url.ok()) {
    return {"LCM URL", CheckState::kStops, url.failure().text(), needed,
            std::string("use --url \"") + kDefaultUrl + "\""};
  }
  const std::string found =
      fmt::format("group {}, port {}, ttl {}", address_text(url->group), url->port, url->ttl);
  if (url->ttl == 0) {
    return {"LCM URL", CheckState::kAdvice, found, "ttl 1 to reach other machines",
            "write ttl=1 unless all robots are on this machine"};
  }
  if (url->ttl > 1) {
    return {"LCM URL", CheckState::kAdvice, found, "ttl 1 on one network",
            "write ttl=1 unless routers between the robots forward multicast"};
  }
  return {"LCM URL", CheckState::kGood, found, needed, ""};
}

Check check_interface(const Outcome<NetworkInterface>& interface) {
  const char* const needed = "up, with an IPv4 address and multicast";
  if (!interface.ok()) {
    return {"interface", CheckState::kStops, interface.failure().text(), needed,
            "give --interface one that `ip -4 address` lists"};
  }
  const std::string found = interface->name + ", " + address_text(interface->address) +
                            (interface->is_up ? ", up" : ", down") +
                            (interface->can_multicast ? ", multicast" : ", no multicast");
  if (!interface->is_up || !interface->can_multicast) {
    // Most systems have a loopback interface without the flag, which forwards multicast as well.
    const bool is_advice = interface->is_up && interface->is_loopback;
    return {"interface", is_advice ? CheckState::kAdvice : CheckState::kStops, found, needed,
            "ip link set " + interface->name + " up multicast on"};
  }
  return {"interface", CheckState::kGood, found, needed, ""};
}

Check check_route(const UdpmUrl& url, const NetworkInterface& interface) {
  const std::string needed = "by " + interface.name;
  const std::string mend = "ip route add 224.0.0.0/4 dev " + interface.name;
  const Outcome<NetworkInterface> route = route_interface(url.group);
  // A node gives the system its interface, so it needs no route; liblcm does.
  if (!route.ok()) {
    return {"multicast route", CheckState::kAdvice, "none: LCM's own tools will not start", needed,
            mend};
  }
  if (route->index != interface.index) {
    return {"multicast route", CheckState::kAdvice,
            "by " + route->name + ": LCM's own tools will not hear the robots", needed, mend};
  }
  return {"multicast route", CheckState::kGood, "by " + route->name, needed, ""};
}

Check check_mtu(const NetworkInterface& interface) {
  const std::string found = fmt::format("{} bytes", interface.mtu_bytes);
  const std::string needed = fmt::format("{} bytes", kMaxIpPacketBytes);
  if (interface.mtu_bytes >= static_cast<int>(kMaxIpPacketBytes))
    return {"MTU", CheckState::kGood, found, needed, ""};
  return {"MTU", CheckState::kStops, found, needed,
          "ip link set " + interface.name + " mtu 1500, and the same on switches and tunnels"};
}

Check check_buffer(const UdpmUrl& url, const DatagramLink& link) {
  // The kernel grants twice the requested size, which includes its own overhead.
  const int granted = link.receive_buffer_bytes() / 2;
  const std::string found = fmt::format("{} bytes", granted);
  const std::string needed = fmt::format("{} bytes", url.receive_buffer_bytes);
  if (granted >= url.receive_buffer_bytes)
    return {"receive buffer", CheckState::kGood, found, needed, ""};
  return {"receive buffer", CheckState::kAdvice, found, needed,
          fmt::format("sysctl -w net.core.rmem_max={}, and the same in /etc/sysctl.d",
                      url.receive_buffer_bytes)};
}

/// Number of its own kEchoes largest datagrams that the link receives.
int count_echoes(DatagramLink& link) {
  const std::vector<std::byte> payload(link.max_payload_bytes(), std::byte{0x5a});
  for (int i = 0; i < kEchoes; ++i) static_cast<void>(link.send(payload));
  std::array<std::byte, kMaxMessageBytes> buffer;
  int heard = 0;
  const std::int64_t end_us = MonotonicClock::now_us() + kEchoTimeout_us;
  while (heard < kEchoes && MonotonicClock::now_us() < end_us) {
    const DatagramLink::Received received = link.receive(buffer);
    if (received.bytes.size() == payload.size()) ++heard;
    if (!received.bytes.empty()) continue;
    const timespec pause{0, kEchoStep_us * 1000};
    ::nanosleep(&pause, nullptr);
  }
  return heard;
}

/// A URL for this machine only, on a channel for this process only.
LinkConfig echo_config(const UdpmUrl& url, const NetworkInterface& interface) {
  return {.url = fmt::format("udpm://{}:{}?ttl=0&recv_buf_size={}", address_text(url.group),
                             url.port, url.receive_buffer_bytes),
          .channel = fmt::format("TESSERA_DOCTOR_{}", ::getpid()),
          .interface = interface.name,
          .queue_slots = 64,
          .hear_itself = true};
}

void check_link(const UdpmUrl& url, const NetworkInterface& interface, std::vector<Check>& checks) {
  const std::string needed = fmt::format("{} of {} heard", kEchoes, kEchoes);
  const Outcome<std::unique_ptr<DatagramLink>> link =
      DatagramLink::open(echo_config(url, interface));
  if (!link.ok()) {
    checks.push_back({"loopback multicast", CheckState::kStops, link.failure().text(), needed,
                      "ip link set " + interface.name + " up multicast on"});
    return;
  }
  checks.push_back(check_buffer(url, **link));
  const int heard = count_echoes(**link);
  const std::string found =
      fmt::format("{} of {} heard, {} not sent", heard, kEchoes, (*link)->report().failed);
  if (heard == kEchoes) {
    checks.push_back({"loopback multicast", CheckState::kGood, found, needed, ""});
    return;
  }
  checks.push_back(
      {"loopback multicast", heard > 0 ? CheckState::kAdvice : CheckState::kStops, found, needed,
       fmt::format("open UDP port {} to {} in the firewall, and fix the MTU if it is too small",
                   url.port, address_text(url.group))});
}

}  // namespace

std::vector<Check> check_network(const DoctorOptions& options) {
  const Outcome<UdpmUrl> url = UdpmUrl::parse(options.url);
  std::vector<Check> checks{check_url(url)};
  if (!url.ok()) return checks;
  const Outcome<NetworkInterface> interface =
      options.interface.empty() ? route_interface(url->group) : find_interface(options.interface);
  checks.push_back(check_interface(interface));
  if (!interface.ok()) return checks;
  checks.push_back(check_route(*url, *interface));
  checks.push_back(check_mtu(*interface));
  check_link(*url, *interface, checks);
  return checks;
}

}  // namespace tessera
