// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Sixty-four robots that all hear each other: no storm.
#include <catch2/catch.hpp>

#include "network/simulated_network.hpp"
#include "support/cloud.hpp"

namespace tessera::network {
namespace {

TEST_CASE("network: 64 robots agree, and each says little more than one of 8 does") {
  const auto bytes_of_each = [](int robots) {
    Network network(robots, {.loss = 0.02}, oracle::announce_seed(541),
                    {.segments = 1U << 15U,
                     .blocks = 1U << 14U,
                     .contributions = 64,
                     .robot_segments = 1U << 14U});
    oracle::Random& random = network.random();
    for (int tick = 0; tick < 80; ++tick) {
      for (int i = 0; i < robots; ++i) {
        const int x = tick / 4 + random.below(8);
        const int voxels = 10 + random.below(60);
        REQUIRE(network.robot(i).publish(*pack({x, random.below(8), 0}), random, voxels).ok());
      }
      network.run(50'000);
    }
    REQUIRE(network.settle(30'000'000));
    const std::uint64_t before = network.sent_bytes();
    network.run(10'000'000);
    const double idle_each = static_cast<double>(network.sent_bytes() - before) / robots / 10.0;
    const double each = static_cast<double>(before) / robots;
    WARN(robots << " robots: " << each << " bytes each, " << idle_each << " a second at rest");
    CHECK(idle_each < 2000.0);
    return each;
  };
  const double few = bytes_of_each(8);
  CHECK(bytes_of_each(64) < 4.0 * few);
}

}  // namespace
}  // namespace tessera::network
