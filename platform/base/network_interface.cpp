// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/network_interface.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <memory>
#include <optional>

#include "base/file_descriptor.hpp"
#include "base/system_failure.hpp"

namespace tessera {
namespace {

std::string text_of_address(std::uint32_t address) {
  const in_addr network_order{htonl(address)};
  char text[INET_ADDRSTRLEN] = {};
  ::inet_ntop(AF_INET, &network_order, text, sizeof text);
  return text;
}

int mtu_of(const char* name) {
  const FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  ifreq request{};
  std::strncpy(request.ifr_name, name, sizeof request.ifr_name - 1);
  return ::ioctl(socket.get(), SIOCGIFMTU, &request) == 0 ? request.ifr_mtu : 0;
}

/// The first IPv4 address for which matches(name, address) is true.
template <class Matches>
std::optional<NetworkInterface> first_interface(Matches matches) {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return std::nullopt;
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(list, &::freeifaddrs);
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    sockaddr_in place{};
    std::memcpy(&place, entry->ifa_addr, sizeof place);
    NetworkInterface found;
    found.name = entry->ifa_name;
    found.address = ntohl(place.sin_addr.s_addr);
    if (!matches(found.name, found.address)) continue;
    found.index = static_cast<int>(::if_nametoindex(entry->ifa_name));
    found.mtu_bytes = mtu_of(entry->ifa_name);
    found.is_up = (entry->ifa_flags & IFF_UP) != 0;
    found.is_loopback = (entry->ifa_flags & IFF_LOOPBACK) != 0;
    found.can_multicast = (entry->ifa_flags & IFF_MULTICAST) != 0;
    return found;
  }
  return std::nullopt;
}

struct RouteQuestion {
  nlmsghdr header{};
  rtmsg route{};
  rtattr attribute{};
  in_addr destination{};
};
static_assert(sizeof(RouteQuestion) == NLMSG_LENGTH(sizeof(rtmsg)) + RTA_LENGTH(sizeof(in_addr)));

/// Queries the kernel's routes by netlink: connecting a socket would not find a loopback interface.
/// 0: there is no route.
int index_of_route(std::uint32_t group) {
  const FileDescriptor socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  RouteQuestion question;
  question.header.nlmsg_len = sizeof question;
  question.header.nlmsg_type = RTM_GETROUTE;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.route.rtm_family = AF_INET;
  question.route.rtm_dst_len = 32;
  question.attribute.rta_type = RTA_DST;
  question.attribute.rta_len = RTA_LENGTH(sizeof(in_addr));
  question.destination.s_addr = htonl(group);
  alignas(nlmsghdr) std::array<char, 4096> answer{};
  if (::send(socket.get(), &question, sizeof question, 0) < 0) return 0;
  const ssize_t bytes = ::recv(socket.get(), answer.data(), answer.size(), 0);
  const auto* const header = reinterpret_cast<const nlmsghdr*>(answer.data());
  if (bytes < static_cast<ssize_t>(NLMSG_LENGTH(sizeof(rtmsg))) ||
      header->nlmsg_len > static_cast<std::size_t>(bytes) || header->nlmsg_type != RTM_NEWROUTE)
    return 0;
  std::size_t at = NLMSG_LENGTH(sizeof(rtmsg));
  while (at + sizeof(rtattr) <= header->nlmsg_len) {
    rtattr attribute{};
    std::memcpy(&attribute, answer.data() + at, sizeof attribute);
    if (attribute.rta_len < sizeof attribute || at + attribute.rta_len > header->nlmsg_len) break;
    if (attribute.rta_type == RTA_OIF && attribute.rta_len == RTA_LENGTH(sizeof(int))) {
      int index = 0;
      std::memcpy(&index, answer.data() + at + RTA_LENGTH(0), sizeof index);
      return index;
    }
    at += RTA_ALIGN(attribute.rta_len);
  }
  return 0;
}

}  // namespace

Outcome<NetworkInterface> find_interface(std::string_view name) {
  std::optional<NetworkInterface> found =
      first_interface([name](const std::string& other, std::uint32_t address) {
        return other == name || text_of_address(address) == name;
      });
  if (found) return *std::move(found);
  return Failure{"no network interface with an IPv4 address is " + std::string(name) +
                 "; choose one that `ip -4 address` lists"};
}

Outcome<NetworkInterface> route_interface(std::uint32_t group) {
  const int index = index_of_route(group);
  std::optional<NetworkInterface> found =
      first_interface([index](const std::string& name, std::uint32_t) {
        return index > 0 && static_cast<int>(::if_nametoindex(name.c_str())) == index;
      });
  if (found) return *std::move(found);
  return Failure{"there is no route to the multicast group " + text_of_address(group) +
                     "; name the interface, or add a route: ip route add 224.0.0.0/4 dev INTERFACE",
                 FailureKind::kFailure};
}

}  // namespace tessera
