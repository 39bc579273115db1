// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A network that is hardly one: it takes hours of virtual time.
#include <catch2/catch.hpp>

#include "network/patch_drive.hpp"
#include "oracle/cloud.hpp"

namespace tessera::network {
namespace {

TEST_CASE("network: one datagram of a hundred is enough") {
  Network network(3, {.loss = 0.99}, oracle::announce_seed(502));
  drive(network, 3 * kSecond, 40);
  REQUIRE(network.settle(200'000 * kSecond));
  WARN(static_cast<double>(network.now_us()) / 1e6 << " s, " << network.sent_bytes() << " bytes");
}

}  // namespace
}  // namespace tessera::network
