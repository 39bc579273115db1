// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "own_network.hpp"

#include <arpa/inet.h>
#include <net/if.h>
#include <net/route.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstring>

namespace tessera {
namespace {

sockaddr address(const char* text) {
  sockaddr_in in{};
  in.sin_family = AF_INET;
  ::inet_pton(AF_INET, text, &in.sin_addr);
  sockaddr generic{};
  std::memcpy(&generic, &in, sizeof generic);
  return generic;
}

/// As `ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo`.
bool set_up_loopback() {
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq flags{};
  std::strcpy(flags.ifr_name, "lo");
  flags.ifr_flags = IFF_UP | IFF_RUNNING | IFF_LOOPBACK | IFF_MULTICAST;
  if (::ioctl(socket.get(), SIOCSIFFLAGS, &flags) != 0) return false;
  char device[] = "lo";
  rtentry route{};
  route.rt_dst = address("224.0.0.0");
  route.rt_genmask = address("240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = device;
  return ::ioctl(socket.get(), SIOCADDRT, &route) == 0;
}

bool make_network() {
  const bool alone = ::unshare(CLONE_NEWNET) == 0 || ::unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0;
  return alone && set_up_loopback();
}

}  // namespace

bool enter_own_network() {
  static const bool entered = make_network();
  if (!entered) WARN("skipped: no network namespaces permitted here (unshare -rn)");
  return entered;
}

LinkConfig loopback_config() {
  return {.url = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152",
          .channel = "TESSERA",
          .interface = "lo",
          .queue_slots = 4096};
}

void wait_a_little() {
  const timespec one_ms{0, 1'000'000};
  ::nanosleep(&one_ms, nullptr);
}

}  // namespace tessera
