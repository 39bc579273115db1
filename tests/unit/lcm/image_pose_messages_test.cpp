// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Images, poses, queries and replies against what LCM generates.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <tessera_depth_image.hpp>
#include <tessera_label_image.hpp>
#include <tessera_query.hpp>
#include <tessera_reply.hpp>
#include <vector>

#include "link/query_messages.hpp"
#include "link/sensor_messages.hpp"
#include "link/sensor_sender.hpp"
#include "unit/lcm/encoded.hpp"

namespace tessera {
namespace {

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
  for (int axis = 0; axis < 3; ++axis) {
    const auto unsure = [&](tessera_pose& p) { p.position_sigma_m[axis] = kNaN; };
    CHECK(fault_with(unsure) == MessageFault::kValue);
  }
  CHECK(fault_with([&](tessera_pose& p) { p.rotation_sigma_rad = kNaN; }) == MessageFault::kValue);
  CHECK(fault_with([](tessera_pose& p) { p.position_sigma_m[2] = HUGE_VAL; }) ==
        MessageFault::kValue);
  // What says itself that it is invalid need not have numbers.
  const auto invalid = [&](tessera_pose& p) {
    p.quality = tessera_pose::INVALID;
    p.rotation[0] = p.rotation_sigma_rad = kNaN;
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
