// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Our decoder against what LCM generates, and against bytes that nobody meant.
#include "lcm/sensor_messages.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <tessera_cloud.hpp>
#include <tessera_depth_image.hpp>
#include <tessera_label_image.hpp>
#include <tessera_pose.hpp>
#include <tessera_query.hpp>
#include <tessera_reply.hpp>
#include <tessera_semantic_cloud.hpp>
#include <vector>

#include "lcm/query_messages.hpp"
#include "lcm/sensor_sender.hpp"

namespace tessera {
namespace {

using Bytes = std::vector<std::byte>;

template <class Message>
Bytes encoded(const Message& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  REQUIRE(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())) ==
          static_cast<int>(bytes.size()));
  return bytes;
}

/// Room for so many points, and a mark behind it that nobody may touch.
struct Room {
  explicit Room(std::size_t points)
      : xyz(3 * points + 1, kMark),
        weights(points + 1, kMark),
        times_s(points + 1, kMark),
        components(points + 1, 77) {}
  static constexpr float kMark = -12345.0F;
  std::vector<float> xyz, weights, times_s;
  std::vector<std::uint8_t> components;

  CloudMemory memory() {
    const auto but_last = [](auto& list) { return std::span(list).first(list.size() - 1); };
    return {but_last(xyz), but_last(components), but_last(weights), but_last(times_s)};
  }
  [[nodiscard]] bool is_untouched() const {
    const auto all = [](const std::vector<float>& list) {
      return std::all_of(list.begin(), list.end(), [](float f) { return f == kMark; });
    };
    return all(xyz) && all(weights) && all(times_s) &&
           std::all_of(components.begin(), components.end(), [](int c) { return c == 77; });
  }
  [[nodiscard]] bool has_marks() const {
    return xyz.back() == kMark && weights.back() == kMark && times_s.back() == kMark &&
           components.back() == 77;
  }
};

tessera_semantic_cloud sample_cloud(std::int32_t points, bool weights, bool times) {
  tessera_semantic_cloud cloud;
  cloud.stamp_us = 0x0102030405060708;
  cloud.sensor = 3;
  cloud.count = points;
  cloud.coordinates = 3 * points;
  cloud.weights = weights ? points : 0;
  cloud.times = times ? points : 0;
  for (std::int32_t i = 0; i < points; ++i) {
    for (int axis = 0; axis < 3; ++axis)
      cloud.xyz.push_back(0.1F * static_cast<float>(i) - static_cast<float>(axis));
    cloud.component.push_back(static_cast<std::uint8_t>(i % 256));
    if (weights) cloud.weight.push_back(0.5F + static_cast<float>(i));
    if (times) cloud.time_us.push_back(100 * i - 5'000);
  }
  return cloud;
}

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
  // Behind fingerprint, stamp and sensor: count, coordinates, weights, times.
  for (std::size_t at = 20; at < 36; at += 4) {
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
    CHECK(fault == (bytes < 36 ? MessageFault::kTooShort : MessageFault::kCounts));
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
  cloud.coordinates = 6;
  cloud.xyz = {1, 2, 3, 4, 5, 6};
  cloud.time_us = {-1, 7};
  Room room(2);
  CloudHeader header;
  REQUIRE(decode_cloud(encoded(cloud), room.memory(), header) == MessageFault::kNone);
  CHECK_FALSE(header.has_components);
  CHECK(header.first_us == -1);
  CHECK(header.last_us == 7);
  CHECK(room.xyz[5] == 6.0F);
}

TEST_CASE("decode_label_image: what LCM's generated code wrote, and sizes that do not fit") {
  tessera_label_image image;
  image.stamp_us = -9;
  image.camera = 2;
  image.width = 3;
  image.height = 2;
  image.pixels = 6;
  image.component = {1, 2, 3, 4, 5, 255};
  std::vector<std::uint8_t> into(6);
  ImageHeader header;
  REQUIRE(decode_label_image(encoded(image), into, header) == MessageFault::kNone);
  CHECK(header.stamp_us == -9);
  CHECK(header.camera == 2);
  CHECK(header.width_px == 3);
  CHECK(header.height_px == 2);
  CHECK(into == image.component);
  std::vector<std::uint8_t> small(5, 9);
  CHECK(decode_label_image(encoded(image), small, header) == MessageFault::kTooLarge);
  CHECK(small == std::vector<std::uint8_t>(5, 9));
  const auto with_size = [&](std::int32_t width, std::int32_t height) {
    tessera_label_image other = image;
    other.width = width;
    other.height = height;
    return decode_label_image(encoded(other), into, header);
  };
  CHECK(with_size(2, 2) == MessageFault::kCounts);
  CHECK(with_size(-3, -2) == MessageFault::kCounts);
  CHECK(with_size(0, 6) == MessageFault::kValue);
  CHECK(with_size(65'536, 65'536) == MessageFault::kTooLarge);
  CHECK(with_size(INT32_MAX, INT32_MAX) == MessageFault::kTooLarge);
}

TEST_CASE("decode_depth_image: metres, millimetres, but not both or neither") {
  tessera_depth_image image;
  image.stamp_us = 4;
  image.camera = 1;
  image.width = 2;
  image.height = 1;
  image.metres = 2;
  image.millimetres = 0;
  image.depth_m = {1.5F, 0.0F};
  std::vector<float> into(2);
  ImageHeader header;
  REQUIRE(decode_depth_image(encoded(image), into, header) == MessageFault::kNone);
  CHECK(into == image.depth_m);
  tessera_depth_image millimetres = image;
  millimetres.metres = 0;
  millimetres.depth_m.clear();
  millimetres.millimetres = 2;
  millimetres.depth_mm = {2'500, static_cast<std::int16_t>(0xffff)};
  REQUIRE(decode_depth_image(encoded(millimetres), into, header) == MessageFault::kNone);
  CHECK(into[0] == Approx(2.5));
  CHECK(into[1] == Approx(65.535));
  tessera_depth_image both = image;
  both.millimetres = 2;
  both.depth_mm = {1, 2};
  CHECK(decode_depth_image(encoded(both), into, header) == MessageFault::kCounts);
  tessera_depth_image neither = image;
  neither.metres = 0;
  neither.depth_m.clear();
  CHECK(decode_depth_image(encoded(neither), into, header) == MessageFault::kCounts);
  std::vector<float> small(1);
  CHECK(decode_depth_image(encoded(image), small, header) == MessageFault::kTooLarge);
}

tessera_pose sample_pose() {
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

TEST_CASE("decode_pose: a quarter turn about z, and what is no pose") {
  PoseMessage pose;
  REQUIRE(encoded(sample_pose()).size() == 112);
  REQUIRE(decode_pose(encoded(sample_pose()), pose) == MessageFault::kNone);
  CHECK(pose.stamp_us == 12);
  CHECK(pose.sequence == 7);
  CHECK(pose.quality == PoseQuality::kGood);
  Matrix34d expected;
  expected << 0, -1, 0, 1, 1, 0, 0, 0, 0, 0, 1, -3;
  CHECK((pose.T_map_body - expected).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(pose.position_sigma_m.y() == 0.25);
  const auto fault_with = [&](auto change) {
    tessera_pose changed = sample_pose();
    change(changed);
    return decode_pose(encoded(changed), pose);
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  CHECK(fault_with([](tessera_pose& p) { p.quality = 3; }) == MessageFault::kValue);
  CHECK(fault_with([](tessera_pose& p) { p.quality = -1; }) == MessageFault::kValue);
  CHECK(fault_with([](tessera_pose& p) { p.rotation[0] = 0.8; }) == MessageFault::kValue);
  CHECK(fault_with([](tessera_pose& p) { p.rotation[0] = 1e300; }) == MessageFault::kValue);
  CHECK(fault_with([&](tessera_pose& p) { p.rotation[1] = kNaN; }) == MessageFault::kValue);
  CHECK(fault_with([&](tessera_pose& p) { p.position_m[1] = kNaN; }) == MessageFault::kValue);
  // What says itself that it is invalid need not have numbers.
  const auto invalid = [&](tessera_pose& p) {
    p.quality = tessera_pose::INVALID;
    p.rotation[0] = kNaN;
  };
  CHECK(fault_with(invalid) == MessageFault::kNone);
}

TEST_CASE("encode: a pose and its quaternion give the pose back, whatever the rotation") {
  std::mt19937 random(11);
  INFO("seed 11");
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    tessera_pose message = sample_pose();
    double squares = 0.0;
    for (double& q : message.rotation) {
      q = part(random);
      // Half turns too, where w is none.
      if (i % 4 == 0 && &q == message.rotation) q = 0.0;
      squares += q * q;
    }
    for (double& q : message.rotation) q /= std::sqrt(squares);
    PoseMessage pose;
    REQUIRE(decode_pose(encoded(message), pose) == MessageFault::kNone);
    PoseMessage again;
    REQUIRE(decode_pose(encode(pose), again) == MessageFault::kNone);
    CHECK((again.T_map_body - pose.T_map_body).cwiseAbs().maxCoeff() < 1e-12);
    CHECK(again.sequence == pose.sequence);
  }
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

TEST_CASE("queries and replies: what LCM's generated code reads and writes, in one datagram") {
  tessera_query query{};
  query.version = 1;
  query.request = 42;
  query.client = -5;
  query.kind = tessera_query::NEAREST;
  query.map = tessera_query::GLOBAL;
  query.flags = tessera_query::STOP_AT_UNKNOWN;
  query.class_mask = -1;
  query.length_m = 2.5;
  query.point[31][2] = 1.25F;
  MapQuery read;
  const Bytes bytes = encoded(query);
  CHECK(bytes.size() == 448);
  REQUIRE(decode_query(bytes, read));
  CHECK(read.request == 42);
  CHECK(read.client == -5);
  CHECK(read.kind == static_cast<int>(QueryKind::kNearest));
  CHECK(read.map == static_cast<int>(QueryMap::kGlobal));
  CHECK(read.stop_at_unknown);
  CHECK(read.class_mask == ~std::uint64_t{0});
  CHECK(read.points[31].z() == 1.25F);
  CHECK_FALSE(decode_query(std::span(bytes).first(447), read));
  MapReply reply;
  reply.request = 42;
  reply.found = true;
  reply.voxel = {1, -2, 3};
  reply.cells[1023] = cell_of(VoxelState::kOccupied, 62);
  reply.probability[31] = 0.5F;
  const auto written = encode_reply(reply);
  tessera_reply message{};
  REQUIRE(message.decode(written.data(), 0, static_cast<int>(written.size())) ==
          static_cast<int>(kReplyBytes));
  CHECK(message.request == 42);
  CHECK(message.flags == tessera_reply::FOUND);
  CHECK(message.voxel[1] == -2);
  CHECK(message.cell[1023] == (2U << 6U | 62U));
  CHECK(message.probability[31] == 0.5F);
  CHECK(state_of_cell(message.cell[1023]) == VoxelState::kOccupied);
  CHECK(label_of_cell(message.cell[1023]) == 62);
}

}  // namespace
}  // namespace tessera
