// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Robots of a simulated network that drive over a patch and publish its blocks.
#pragma once

#include <catch2/catch.hpp>

#include "network/simulated_network.hpp"

namespace tessera::network {

inline constexpr std::int64_t kSecond = 1'000'000;

/// A block of a patch that the robot drives over: blocks are seen several times, then left behind.
inline BlockKey patch_block(oracle::Random& random, std::int64_t now_us) {
  const auto along = static_cast<std::int32_t>(now_us / 200'000);
  const int x = along + random.below(8);
  const int y = random.below(8);
  return *pack({x, y, random.below(2)});
}

/// All that are there drive for so long, and publish so many blocks a second each.
inline void drive(Network& network, std::int64_t duration_us, int blocks_per_s,
                  bool with_room = true) {
  for (const std::int64_t end = network.now_us() + duration_us; network.now_us() < end;) {
    for (int i = 0; i < network.size(); ++i) {
      for (int block = 0; block < blocks_per_s / 20; ++block) {
        // One draw a statement: arguments are evaluated in any order.
        const BlockKey key = patch_block(network.random(), network.now_us());
        const int voxels = 10 + network.random().below(60);
        const bool published = network.robot(i).publish(key, network.random(), voxels).ok();
        REQUIRE((published || !with_room));
      }
    }
    network.run(kSecond / 20);
  }
}

}  // namespace tessera::network
