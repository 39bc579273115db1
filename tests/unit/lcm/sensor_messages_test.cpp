// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Our decoder against what LCM generates, and against bytes that nobody meant.
#include "link/sensor_messages.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <tessera_cloud.hpp>
#include <tessera_label_image.hpp>
#include <tessera_semantic_cloud.hpp>
#include <vector>

#include "link/short_message.hpp"
#include "unit/lcm/encoded.hpp"
#include "unit/lcm/sample_cloud.hpp"

namespace tessera {
namespace {

TEST_CASE("decode_semantic_cloud: what LCM's generated code wrote, number by number") {
  for (const bool weights : {false, true}) {
    for (const bool times : {false, true}) {
      const tessera_semantic_cloud cloud = sample_cloud(300, weights, times);
      Room room(300);
      CloudHeader header;
      REQUIRE(decode_semantic_cloud(encoded(cloud), room.memory(), header) == MessageFault::kNone);
      CHECK(header.stamp_us == cloud.stamp_us);
      CHECK(header.sensor == 3);
      CHECK(header.count == 300);
      CHECK(header.has_components);
      CHECK(header.has_weights == weights);
      CHECK(header.has_times == times);
      CHECK(std::equal(cloud.xyz.begin(), cloud.xyz.end(), room.xyz.begin()));
      CHECK(std::equal(cloud.component.begin(), cloud.component.end(), room.components.begin()));
      if (weights)
        CHECK(std::equal(cloud.weight.begin(), cloud.weight.end(), room.weights.begin()));
      CHECK(header.has_no_return == weights);
      if (weights)
        CHECK(std::equal(cloud.no_return.begin(), cloud.no_return.end(), room.no_return.begin()));
      CHECK(header.first_us == (times ? -5'000 : 0));
      CHECK(header.last_us == (times ? 100 * 299 - 5'000 : 0));
      if (times) CHECK(room.times_s[1] == Approx(-4'900e-6));
      CHECK(room.has_marks());
    }
  }
}

TEST_CASE("decode_semantic_cloud: numbers of the sensor that are not finite are handed on") {
  tessera_semantic_cloud cloud = sample_cloud(2, true, false);
  cloud.xyz[1] = std::numeric_limits<float>::quiet_NaN();
  cloud.weight[0] = std::numeric_limits<float>::infinity();
  Room room(2);
  CloudHeader header;
  REQUIRE(decode_semantic_cloud(encoded(cloud), room.memory(), header) == MessageFault::kNone);
  CHECK(std::isnan(room.xyz[1]));
  CHECK(std::isinf(room.weights[0]));
}

TEST_CASE("decode_semantic_cloud: one point more than there is room for is refused untouched") {
  CloudHeader header;
  for (const std::int32_t points : {9, 10, 11}) {
    Room room(10);
    const MessageFault fault =
        decode_semantic_cloud(encoded(sample_cloud(points, true, true)), room.memory(), header);
    CHECK(fault == (points > 10 ? MessageFault::kTooLarge : MessageFault::kNone));
    CHECK(room.is_untouched() == (points > 10));
    CHECK(room.has_marks());
  }
  Room room(0);
  CHECK(decode_semantic_cloud(encoded(sample_cloud(0, false, false)), room.memory(), header) ==
        MessageFault::kNone);
  CHECK(header.count == 0);
}

TEST_CASE("decode_semantic_cloud: counts that disagree, or lie about the length, write nothing") {
  const Bytes good = encoded(sample_cloud(4, true, true));
  // Behind fingerprint, stamp and sensor: count, coordinates, components, label_weights, weights,
  // times, no_returns.
  for (std::size_t at = 20; at < 48; at += 4) {
    for (const std::uint32_t lie : {0xffffffffU, 0x80000000U, 0x7fffffffU, 3U, 5U, 1U << 28U}) {
      INFO("count at " << at << " is " << lie);
      Bytes bad = good;
      detail::write_big_endian(lie, std::span(bad).subspan(at));
      Room room(100);
      CloudHeader header;
      CHECK(decode_semantic_cloud(bad, room.memory(), header) == MessageFault::kCounts);
      CHECK(room.is_untouched());
    }
  }
}

TEST_CASE("decode_semantic_cloud: shorter by any number of bytes, or longer, writes nothing") {
  const Bytes good = encoded(sample_cloud(4, true, true));
  CloudHeader header;
  for (std::size_t bytes = 0; bytes < good.size(); ++bytes) {
    Room room(100);
    const Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(bytes));
    const MessageFault fault = decode_semantic_cloud(cut, room.memory(), header);
    CHECK(fault == (bytes < 48 ? MessageFault::kTooShort : MessageFault::kCounts));
    CHECK(room.is_untouched());
  }
  Bytes longer = good;
  longer.push_back(std::byte{0});
  Room room(100);
  CHECK(decode_semantic_cloud(longer, room.memory(), header) == MessageFault::kCounts);
  CHECK(room.is_untouched());
}

TEST_CASE("decode: another type, or another version of it, is told by its fingerprint") {
  Room room(10);
  CloudHeader cloud;
  ImageHeader image;
  PoseMessage pose;
  const Bytes semantic = encoded(sample_cloud(1, false, false));
  CHECK(decode_cloud(semantic, room.memory(), cloud) == MessageFault::kOtherType);
  CHECK(decode_label_image(semantic, room.components, image) == MessageFault::kOtherType);
  CHECK(decode_depth_image(semantic, room.xyz, image) == MessageFault::kOtherType);
  CHECK(decode_pose(semantic, pose) == MessageFault::kOtherType);
  Bytes changed = semantic;
  changed[7] ^= std::byte{1};
  CHECK(decode_semantic_cloud(changed, room.memory(), cloud) == MessageFault::kOtherType);
}

TEST_CASE("decode_semantic_cloud: a time over a second from the stamp is refused") {
  CloudHeader header;
  for (const std::int32_t time_us :
       {kMostSweep_us, -kMostSweep_us, kMostSweep_us + 1, -kMostSweep_us - 1, INT32_MIN}) {
    tessera_semantic_cloud cloud = sample_cloud(2, false, true);
    cloud.time_us[1] = time_us;
    Room room(2);
    const bool within = std::abs(static_cast<double>(time_us)) <= kMostSweep_us;
    CHECK(decode_semantic_cloud(encoded(cloud), room.memory(), header) ==
          (within ? MessageFault::kNone : MessageFault::kValue));
  }
}

TEST_CASE("decode_cloud: points without components, with their times") {
  tessera_cloud cloud;
  cloud.stamp_us = 5;
  cloud.sensor = 1;
  cloud.count = cloud.times = 2;
  cloud.no_returns = 2;
  cloud.coordinates = 6;
  cloud.xyz = {1, 2, 3, 4, 5, 6};
  cloud.time_us = {-1, 7};
  cloud.no_return = {0, 1};
  Room room(2);
  CloudHeader header;
  REQUIRE(decode_cloud(encoded(cloud), room.memory(), header) == MessageFault::kNone);
  CHECK_FALSE(header.has_components);
  CHECK(header.first_us == -1);
  CHECK(header.last_us == 7);
  CHECK(room.xyz[5] == 6.0F);
  CHECK(header.has_no_return);
  CHECK(room.no_return[1] == 1);
  // A receiver without room for them refuses what has some.
  CloudMemory without = room.memory();
  without.no_return = {};
  CHECK(decode_cloud(encoded(cloud), without, header) == MessageFault::kTooLarge);
}

TEST_CASE("decode: 20,000 changed messages stay within their memory, in every decoder") {
  constexpr unsigned kSeed = 21;
  INFO("seed " << kSeed);
  std::mt19937 random(kSeed);
  tessera_label_image image;
  image.stamp_us = 1;
  image.camera = 0;
  image.width = image.height = 4;
  image.pixels = 16;
  image.component.resize(16);
  const std::vector<Bytes> seeds{encoded(sample_cloud(12, true, true)), encoded(image),
                                 encoded(sample_pose())};
  int accepted = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::size_t which = random() % seeds.size();
    Bytes bytes = seeds[which];
    for (int changes = static_cast<int>(random() % 4); changes > 0; --changes) {
      const std::size_t at = random() % bytes.size();
      bytes[at] = static_cast<std::byte>(random());
    }
    if (random() % 4 == 0) bytes.resize(random() % (bytes.size() + 1));
    bytes.shrink_to_fit();
    Room room(12);
    std::vector<std::uint8_t> pixels(16);
    CloudHeader cloud;
    ImageHeader header;
    PoseMessage pose;
    accepted += decode_semantic_cloud(bytes, room.memory(), cloud) == MessageFault::kNone;
    accepted += decode_label_image(bytes, pixels, header) == MessageFault::kNone;
    accepted += decode_pose(bytes, pose) == MessageFault::kNone;
    REQUIRE(room.has_marks());
  }
  CHECK(accepted > 1'000);
}

}  // namespace
}  // namespace tessera
