// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames in a datagram: what is written is what is read, in one code.
#include "tessera/exchange/internal/frames.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <functional>
#include <vector>

#include "support/cloud.hpp"
#include "support/random.hpp"
#include "tessera/base/internal/quaternion.hpp"
#include "tessera/base/internal/rigid_code_io.hpp"

namespace tessera {
namespace {

constexpr std::uint32_t kRobot = 7;

struct Body {
  std::vector<std::byte> bytes = std::vector<std::byte>(kMostBodyBytes);
  ByteWriter to{bytes};
  FrameWriter frames{to};
  /// The frames that a datagram with these bytes has; all of them or none.
  [[nodiscard]] static std::vector<FrameBody> read(std::span<const std::byte> bytes) {
    ByteReader from(bytes);
    FrameReader reader(from, kRobot, false);
    std::vector<FrameBody> all;
    std::span<const std::byte> proof;
    while (from.remaining() != 0) {
      if (!reader.read(all.emplace_back(), proof)) return {};
    }
    return all;
  }
  [[nodiscard]] std::vector<FrameBody> read() const { return read(to.written()); }
};

std::uint32_t any_number(oracle::Random& random) {
  return static_cast<std::uint32_t>(random.bits() >> (32 + random.below(32)));
}

Matrix34d any_rigid(oracle::Random& random) {
  Quaternion q{};
  for (double& part : q) part = random.uniform(-1.0, 1.0);
  normalise(q);
  return transform_of(q, {random.uniform(-900.0, 900.0), random.uniform(-900.0, 900.0), 1.0 / 3});
}

BlockExtent any_extent(oracle::Random& random) {
  BlockExtent extent;
  for (int i = random.below(3); i > 0; --i) {
    const int most = random.below(2) == 0 ? 200 : 2 * kBlockLimit;
    const auto part = [&] { return random.below(most) - most / 2; };
    extent.include(BlockCoord{part(), part(), part()});
  }
  return extent;
}

FrameBody any_frame(oracle::Random& random) {
  FrameBody frame{.id = {kRobot, any_number(random), any_number(random)},
                  .revision = 1 + any_number(random) / 2,
                  .T_global_map = any_rigid(random),
                  .extent = any_extent(random)};
  if (random.below(2) == 0) frame.T_global_map = *round_rigid(frame.T_global_map);
  if (MapSession::is(frame.id.submap |= random.below(3) == 0 ? MapSession::kFirst : 0U)) {
    frame.session = {random.bits(), static_cast<std::int64_t>(random.bits()),
                     static_cast<std::uint16_t>(random.below(MapSession::kFullWeight + 1))};
  }
  return frame;
}

bool same(const FrameBody& a, const FrameBody& b) {
  for (Eigen::Index i = 0; i < a.T_global_map.size(); ++i) {
    if (std::bit_cast<std::uint64_t>(a.T_global_map.data()[i]) !=
        std::bit_cast<std::uint64_t>(b.T_global_map.data()[i]))
      return false;
  }
  return a.id == b.id && a.revision == b.revision && a.extent == b.extent && a.session == b.session;
}

TEST_CASE("frames: what is written is what is read to the last bit, and what is cut is refused") {
  oracle::Random random(oracle::announce_seed(641));
  for (int round = 0; round < 1000; ++round) {
    Body body;
    std::vector<FrameBody> frames;
    std::vector<std::size_t> ends;
    for (int i = random.below(17); i >= 0; --i) {
      const FrameBody frame = any_frame(random);
      const std::size_t before = body.to.size();
      if (!body.frames.write(frame)) {
        CHECK(body.to.size() == before);
        CHECK((frames.size() == kMostFrames || body.to.room() < kMostFrameBytes));
        continue;
      }
      CHECK(body.to.size() - before <= kMostFrameBytes);
      frames.push_back(frame);
      ends.push_back(body.to.size());
    }
    const std::vector<FrameBody> read = body.read();
    REQUIRE(read.size() == frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) CHECK(same(read[i], frames[i]));
    const auto cut = static_cast<std::size_t>(random.below(static_cast<int>(body.to.size())));
    if (cut != 0 && std::find(ends.begin(), ends.end(), cut) == ends.end())
      CHECK(Body::read(body.to.written().first(cut)).empty());
  }
}

TEST_CASE("frames: what damage leaves is refused, or is the only code of what it says") {
  oracle::Random random(oracle::announce_seed(642));
  int accepted = 0;
  for (int round = 0; round < 20'000; ++round) {
    Body body;
    for (int i = random.below(3); i >= 0; --i) REQUIRE(body.frames.write(any_frame(random)));
    const auto at = static_cast<std::size_t>(random.below(static_cast<int>(body.to.size())));
    body.bytes[at] ^= static_cast<std::byte>(1 + random.below(255));
    const std::vector<FrameBody> read = body.read();
    if (read.empty()) continue;
    ++accepted;
    Body again;
    for (const FrameBody& frame : read) REQUIRE(again.frames.write(frame));
    REQUIRE(again.to.size() == body.to.size());
    CHECK(std::equal(again.bytes.begin(), again.bytes.end(), body.bytes.begin()));
  }
  CHECK(accepted > 1000);
}

TEST_CASE("frames: those of a correction take few bytes each, and 16 go into a datagram") {
  oracle::Random random(oracle::announce_seed(643));
  Body body;
  for (std::uint32_t submap = 0; submap < kMostFrames; ++submap) {
    FrameBody frame{.id = {kRobot, 3, 100 + submap},
                    .revision = 40,
                    .T_global_map = *round_rigid(any_rigid(random))};
    const auto x = static_cast<std::int32_t>(submap);
    frame.extent.include(BlockCoord{-20 - x, -60, -2});
    frame.extent.include(BlockCoord{35, 50 + x, 6});
    const std::size_t before = body.to.size();
    REQUIRE(body.frames.write(frame));
    CHECK(body.to.size() - before <= 35);
  }
  const std::size_t before = body.to.size();
  CHECK_FALSE(body.frames.write({.id = {kRobot, 3, 200}, .revision = 1}));
  CHECK(body.to.size() == before);
  CHECK(body.read().size() == kMostFrames);
  // A reader takes no more either.
  const std::vector<std::byte> another{std::byte{2}, std::byte{0}, std::byte{2}, std::byte{0}};
  body.to.bytes(another);
  write_rigid_code(body.to, {});
  CHECK(body.read().empty());
}

TEST_CASE("frames: a transform that the short code stands for has no other one") {
  const Matrix34d moved = *round_rigid([] {
    oracle::Random random(4);
    return any_rigid(random);
  }());
  const bool is_short = GENERATE(false, true);
  const bool is_rounded = GENERATE(false, true);
  Matrix34d T = moved;
  if (!is_rounded) T(0, 3) += 1e-5;
  Body body;
  body.to.u8(is_short ? 2 : 3);
  for (int i = 0; i < 3; ++i) body.to.u8(2);
  if (is_short) {
    write_rigid_code(body.to, *encode_rigid(T));
  } else {
    for (Eigen::Index i = 0; i < 12; ++i) body.to.f64(T(i / 4, i % 4));
  }
  const std::vector<FrameBody> read = body.read();
  if (is_short) {
    REQUIRE(read.size() == 1);
    CHECK(read[0].T_global_map == moved);
  } else {
    CHECK(read.empty() == is_rounded);
  }
}

TEST_CASE("frames: a zero with a sign is not that of a short code") {
  FrameBody frame{.id = {kRobot, 1, 1}, .revision = 1};
  frame.T_global_map(1, 3) = -0.0;
  Body body;
  REQUIRE(body.frames.write(frame));
  CHECK(body.to.size() > 96);
  const std::vector<FrameBody> read = body.read();
  REQUIRE(read.size() == 1);
  CHECK(same(read[0], frame));
}

TEST_CASE("frames: codes that nobody writes are refused") {
  const auto put = [](ByteWriter& to, std::initializer_list<unsigned> bytes) {
    for (const unsigned byte : bytes) to.u8(static_cast<std::uint8_t>(byte));
  };
  // Flags, steps of epoch, submap and revision, a transform, an extent.
  const auto body_of = [](const std::function<void(ByteWriter&)>& write) {
    Body body;
    write(body.to);
    return !body.read().empty();
  };
  const auto begin = [](ByteWriter& to, unsigned flags, const RigidCode& code = {}) {
    to.u8(static_cast<std::uint8_t>(flags));
    for (int i = 0; i < 3; ++i) to.u8(2);
    write_rigid_code(to, code);
  };
  REQUIRE(body_of([&](ByteWriter& to) { begin(to, 2); }));
  REQUIRE(body_of([&](ByteWriter& to) {
    begin(to, 0);
    for (int i = 0; i < 6; ++i) to.u8(0);
  }));
  SECTION("a flag that is none") {
    CHECK_FALSE(body_of([&](ByteWriter& to) { begin(to, 2U + 4U); }));
  }
  SECTION("no revision") {
    CHECK_FALSE(body_of([&](ByteWriter& to) {
      to.u8(2);
      put(to, {2, 2, 0});
      write_rigid_code(to, {});
    }));
  }
  SECTION("a varint with a byte too many") {
    CHECK_FALSE(body_of([&](ByteWriter& to) {
      to.u8(2);
      put(to, {0x82, 0, 2, 2});
      write_rigid_code(to, {});
    }));
  }
  SECTION("a part of a code that is too large, or left out for no reason") {
    CHECK_FALSE(body_of([&](ByteWriter& to) { begin(to, 2, {.largest = 4}); }));
    CHECK_FALSE(body_of([&](ByteWriter& to) { begin(to, 2, {.rotation = {6'000'000, 0, 0}}); }));
    // As large as the part that is left out, which the rule for equal ones would leave in.
    const RigidCode code = *encode_rigid(transform_of({0.5, 0.5, 0.5, 0.5}, Point3d::Zero()));
    CHECK(body_of([&](ByteWriter& to) { begin(to, 2, code); }));
    RigidCode other = code;
    other.largest = static_cast<std::uint8_t>((code.largest + 1) % 4);
    CHECK_FALSE(body_of([&](ByteWriter& to) { begin(to, 2, other); }));
  }
  SECTION("an extent beyond the grid") {
    const auto extent = [&](std::uint32_t low, std::uint32_t size) {
      return body_of([&](ByteWriter& to) {
        begin(to, 0);
        for (const std::uint32_t number : {low, 0U, 0U, size, 0U, 0U}) {
          for (std::uint32_t rest = number;; rest >>= 7U) {
            to.u8(static_cast<std::uint8_t>(rest < 128 ? rest : rest | 128U));
            if (rest < 128) break;
          }
        }
      });
    };
    constexpr auto kLowest = static_cast<std::uint32_t>(2 * kBlockLimit - 1);
    CHECK(extent(kLowest, kLowest));
    CHECK_FALSE(extent(kLowest, kLowest + 1));
    CHECK_FALSE(extent(kLowest + 2, 1));
    CHECK_FALSE(extent(kLowest + 1, 0));
    CHECK_FALSE(extent(2, ~0U));
  }
  SECTION("more than the whole weight of a map session") {
    for (const std::uint16_t weight : {MapSession::kFullWeight, std::uint16_t{0x8001}}) {
      const bool read = body_of([&](ByteWriter& to) {
        to.u8(2);
        to.u8(2);
        // kFirst is -65536.
        put(to, {0xff, 0xff, 7, 2});
        write_rigid_code(to, {});
        to.u64(1);
        to.u64(2);
        to.u16(weight);
      });
      CHECK(read == (weight == MapSession::kFullWeight));
    }
  }
  SECTION("flags of the datagram") {
    for (const int flags : {0, 1, 2, 0x80}) {
      const std::array<std::byte, 5> bytes{static_cast<std::byte>(flags)};
      ByteReader from(bytes);
      FramesHeader header;
      CHECK(read_frames_header(from, header) == (flags <= 1));
    }
  }
}

}  // namespace
}  // namespace tessera
