// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A network that is hardly one: it takes hours of virtual time.
#include <catch2/catch.hpp>

#include "network/patch_drive.hpp"
#include "support/cloud.hpp"

namespace tessera::network {
namespace {

TEST_CASE("network: one datagram of a hundred is enough") {
  Network network(3, {.loss = 0.99}, oracle::announce_seed(502));
  drive(network, 3 * kSecond, 40);
  REQUIRE(network.settle(200'000 * kSecond));
  WARN(static_cast<double>(network.now_us()) / 1e6 << " s, " << network.sent_bytes() << " bytes");
}

TEST_CASE("network: with more gaps than are remembered, what any robot has all come to have") {
  Network network(3, {.loss = 1.0}, oracle::announce_seed(510));
  for (const int to : {1, 2}) network.set_link(0, to, {.loss = 0.5});
  // One block a datagram, and nobody can ask.
  for (int i = 0; i < 1500; ++i) {
    REQUIRE(network.robot(0).publish(*pack({i, 0, 0}), network.random(), 400).ok());
    if (i % 10 == 0) network.run(kSecond / 20);
  }
  network.run(5 * kSecond);
  CHECK_FALSE(network.agree());
  network.switch_off(0);
  network.set_link({.loss = 0.05});
  REQUIRE(network.settle(300 * kSecond));
  const Replicas& replicas = network.robot(1).replicas();
  CHECK(replicas.contribution(*replicas.find({0, 1, 0})).blocks > 1000);
}

}  // namespace
}  // namespace tessera::network
