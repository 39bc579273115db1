// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot objects to, as bytes.
#include "tessera/replica/objection.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {
namespace {

Objection random_objection(oracle::Random& random) {
  const auto any = [&] { return static_cast<std::uint32_t>(random.below(1 << 30)); };
  const auto coordinate = [&] { return random.below(2 << 17) - (1 << 17); };
  Objection one;
  one.against = {any(), any(), any() % 1000};
  one.key = pack_in_grid({coordinate(), coordinate(), coordinate()});
  one.version = any();
  for (int count = 1 + random.below(600); count > 0; --count)
    add_row(one.voxels, random.below(kBlockVoxels));
  return one;
}

std::vector<std::byte> bytes_of(const Objection& one) {
  std::vector<std::byte> bytes(Objection::kMostBytes);
  bytes.resize(one.write(bytes));
  return bytes;
}

}  // namespace

TEST_CASE("objection: what is read is what was written, and is written alike") {
  oracle::Random random(oracle::announce_seed(311));
  for (int i = 0; i < 200; ++i) {
    const Objection one = random_objection(random);
    const std::vector<std::byte> bytes = bytes_of(one);
    REQUIRE(!bytes.empty());
    Objection read;
    REQUIRE(read.read(bytes));
    CHECK(read.against == one.against);
    CHECK(read.key == one.key);
    CHECK(read.version == one.version);
    CHECK(read.voxels == one.voxels);
    CHECK(bytes_of(read) == bytes);
    const BlockCoord place = unpack(Objection::place_of(one.against, one.key));
    CHECK((place.x >= 0 && place.x < 128 && place.y >= 0 && place.y < 128 && place.z == 0));
  }
}

TEST_CASE("objection: bytes that are not as they are written are refused") {
  oracle::Random random(oracle::announce_seed(312));
  const std::vector<std::byte> good = bytes_of(random_objection(random));
  Objection read;
  for (std::size_t size = 0; size < good.size(); ++size)
    CHECK_FALSE(read.read(std::span(good).first(size)));
  std::vector<std::byte> bad = good;
  bad.push_back(std::byte{1});
  CHECK_FALSE(read.read(bad));
  bad = good;
  bad.back() = std::byte{0};  // a row that is said to have a voxel
  CHECK_FALSE(read.read(bad));
  // Against no voxel, and against what has no blocks.
  CHECK_FALSE(read.read(bytes_of({.against = {1, 2, 3}, .key = pack_in_grid({1, 2, 3})})));
  for (const std::uint32_t submap : {Objection::kNumber, FrameStatements::kNumber}) {
    Objection against_none = random_objection(random);
    against_none.against.submap = submap;
    CHECK_FALSE(read.read(bytes_of(against_none)));
  }
  // No bytes, however random, are read beyond their end or written otherwise.
  for (int i = 0; i < 20000; ++i) {
    std::vector<std::byte> any = good;
    for (int changes = 1 + random.below(3); changes > 0; --changes)
      any[static_cast<std::size_t>(random.below(static_cast<int>(any.size())))] =
          static_cast<std::byte>(random.below(256));
    if (read.read(any)) CHECK(bytes_of(read) == any);
  }
}

}  // namespace tessera
