// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Corrections against what LCM generates.
#include <catch2/catch.hpp>
#include <limits>
#include <tessera_correction.hpp>
#include <vector>

#include "link/sensor_messages.hpp"
#include "link/sensor_sender.hpp"
#include "unit/lcm/encoded.hpp"

namespace tessera {
namespace {

struct CorrectionRoom {
  explicit CorrectionRoom(std::size_t poses) : keys(poses, 77), transforms(12 * poses, 7.0) {}
  MessageFault decode(const std::vector<std::byte>& bytes) {
    return decode_correction(bytes, {keys, transforms}, header);
  }
  std::vector<std::int64_t> keys;
  std::vector<double> transforms;
  CorrectionHeader header;
};

tessera_correction sample() {
  tessera_correction message;
  message.robot = 3;
  message.revision = 9;
  message.kind = 0;
  message.count = 2;
  message.keys = {-5, 1'000'000};
  message.position_m = {{1, 2, 3}, {4, 5, 6}};
  message.rotation = {{1, 0, 0, 0}, {0.5, 0.5, 0.5, 0.5}};  // the second: x to y to z
  message.position_sigma_m = {0.1, -1};
  message.rotation_sigma_rad = {0.01, -1};
  return message;
}

TEST_CASE("decode_correction: what LCM's generated code wrote") {
  CorrectionRoom room(3);
  REQUIRE(room.decode(encoded(sample())) == MessageFault::kNone);
  CHECK(room.header.robot == 3);
  CHECK(room.header.revision == 9);
  CHECK_FALSE(room.header.of_submaps);
  CHECK(room.header.count == 2);
  CHECK(room.keys == std::vector<std::int64_t>{-5, 1'000'000, 77});
  const std::vector<double> said{1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3,
                                 0, 0, 1, 4, 1, 0, 0, 5, 0, 1, 0, 6};
  for (std::size_t i = 0; i < said.size(); ++i) CHECK(room.transforms[i] == Approx(said[i]));
  CHECK(room.transforms[24] == 7.0);
}

TEST_CASE("decode_correction: what we write is read, of poses and of submaps") {
  for (const bool of_submaps : {false, true}) {
    const std::vector<std::int64_t> keys{0, 7};
    std::vector<Matrix34d> poses(2, Matrix34d::Identity());
    poses[1](2, 3) = -4.0;
    CorrectionRoom room(2);
    REQUIRE(
        room.decode(encode(CorrectionToSend{
            .robot = 1, .revision = 2, .of_submaps = of_submaps, .keys = keys, .poses = poses})) ==
        MessageFault::kNone);
    CHECK(room.header.of_submaps == of_submaps);
    CHECK(room.keys == keys);
    CHECK(room.transforms[23] == -4.0);
  }
}

TEST_CASE("decode_correction: each fault has its name, and leaves the header as it was") {
  CorrectionRoom room(2);
  const auto fault = [&](auto change) {
    tessera_correction message = sample();
    change(message);
    return room.decode(encoded(message));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(fault([](auto& m) { m.revision = 0; }) == MessageFault::kValue);
  CHECK(fault([](auto& m) { m.revision = -1; }) == MessageFault::kValue);
  CHECK(fault([](auto& m) { m.kind = 2; }) == MessageFault::kValue);
  CHECK(fault([](auto& m) { m.rotation[1] = {0, 0, 0, 0}; }) == MessageFault::kValue);
  CHECK(fault([](auto& m) { m.rotation[1] = {2, 0, 0, 0}; }) == MessageFault::kValue);
  CHECK(fault([nan](auto& m) { m.position_m[0][1] = nan; }) == MessageFault::kValue);
  CHECK(fault([nan](auto& m) { m.position_sigma_m[0] = nan; }) == MessageFault::kValue);
  CHECK(fault([nan](auto& m) { m.rotation_sigma_rad[1] = nan; }) == MessageFault::kValue);
  std::vector<std::byte> bytes = encoded(sample());
  CHECK(CorrectionRoom(1).decode(bytes) == MessageFault::kTooLarge);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::vector<std::byte> cut(bytes.begin(),
                                     bytes.begin() + static_cast<std::ptrdiff_t>(size));
    REQUIRE(room.decode(cut) != MessageFault::kNone);
  }
  bytes[8 + 3 * 4] = std::byte{0xff};  // billions of poses
  CHECK(room.decode(bytes) == MessageFault::kCounts);
  bytes[0] ^= std::byte{1};
  CHECK(room.decode(bytes) == MessageFault::kOtherType);
  CHECK(room.header.count == 0);
}

}  // namespace
}  // namespace tessera
