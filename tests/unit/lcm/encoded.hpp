// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Messages as LCM's generated code writes them.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <tessera_pose.hpp>
#include <vector>

namespace tessera {

using Bytes = std::vector<std::byte>;

template <class Message>
Bytes encoded(const Message& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  REQUIRE(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())) ==
          static_cast<int>(bytes.size()));
  return bytes;
}

inline tessera_pose sample_pose() {
  tessera_pose pose{};
  pose.stamp_us = 12;
  pose.sequence = 7;
  pose.quality = tessera_pose::GOOD;
  pose.position_m[0] = 1.0;
  pose.position_m[2] = -3.0;
  // A quarter turn about z.
  pose.rotation[0] = pose.rotation[3] = std::sqrt(0.5);
  pose.position_sigma_m[1] = 0.25;
  pose.rotation_sigma_rad = -1.0;
  return pose;
}

}  // namespace tessera
