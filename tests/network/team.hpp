// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A simulated network of robots that publish, for tests of what attacks leave.
#pragma once

#include <catch2/catch.hpp>

#include "network/simulated_network.hpp"

namespace tessera::network {

inline constexpr std::int64_t kSecond = 1'000'000;

struct Team : Network {
  Team(int robots, std::uint64_t seed, bool with_signatures = true, const Link& link = {},
       const ExchangeConfig& config = {})
      : Network(robots, link, oracle::announce_seed(seed), default_replicas(), config,
                with_signatures) {}
  void publish(int i, int blocks, int from_x = 0) {
    for (int block = 0; block < blocks; ++block)
      REQUIRE(robot(i).publish(*pack({from_x + block, i, 0}), random(), 30).ok());
  }
  [[nodiscard]] ExchangeReport report(int i) { return robot(i).exchange().report(); }
  void say(int to, const std::vector<std::byte>& datagram) {
    robot(to).exchange().receive(datagram, clock_us(to, now_us()));
  }
  [[nodiscard]] bool all_complete() {
    bool complete = true;
    for (int i = 0; i < size(); ++i)
      complete = complete && report(i).complete == report(i).contributions;
    return complete;
  }
};

}  // namespace tessera::network
