// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Blocks as records that each fit a datagram: one part, or as few as do.
#include "tessera/exchange/internal/record_maker.hpp"

#include <catch2/catch.hpp>

#include "records_rig.hpp"

namespace tessera {
namespace {

constexpr ContributionId kId{7, 1, 0};
constexpr BlockCoord kBlock{1, -2, 3};

/// A block that no datagram takes as a whole.
void fill_beyond_datagram(BlockContent& content) {
  oracle::Random random(11);
  fill_at_random(content, random, kRigComponents, 3, 1.0);
}

TEST_CASE("RecordMaker: a small block is one record, and the next one has the next version") {
  RecordsRig rig(7);
  HeldContribution& own = rig.open(kId);
  OwnContent content(kRigComponents);
  fill_voxel(*content, 8, 2.0F);
  const Result<std::uint32_t> bytes = rig.publish(own, kBlock, *content);
  REQUIRE(bytes.ok());
  CHECK(*bytes == coded(*content).size() + 8);
  CHECK(rig.published == VersionRange{1, 1});
  REQUIRE(rig.publish(own, {9, 9, 9}, *content).ok());
  CHECK(rig.published == VersionRange{2, 2});
  CHECK(own.latest == 2);
  CHECK(own.records == 2);
  CHECK(own.coverage.complete_to() == 2);
  CHECK(rig.counted.published_parts == 2);
}

TEST_CASE("RecordMaker: what is published reads as whoever decodes its code reads it") {
  RecordsRig rig(7);
  HeldContribution& own = rig.open(kId);
  OwnContent content(kRigComponents);
  oracle::Random random(5);
  fill_smoothly(*content, random, kRigComponents);
  REQUIRE(rig.publish(own, kBlock, *content).ok());
  OwnContent decoded(kRigComponents);
  REQUIRE(decode_block(coded(*content), kAllLayers, kRigComponents, *decoded) == Status::kOk);
  OwnContent read(kRigComponents);
  REQUIRE(rig.records.read_block(own, *pack(kBlock), *read));
  CHECK(picture_of(*read, kRigComponents) == picture_of(*decoded, kRigComponents));
}

TEST_CASE("RecordMaker: a large block comes in parts that each fit and together have all layers") {
  RecordsRig rig(7);
  HeldContribution& own = rig.open(kId);
  OwnContent content(kRigComponents);
  fill_beyond_datagram(*content);
  REQUIRE(coded(*content).size() > kMostCodedBytes);
  REQUIRE(rig.publish(own, kBlock, *content).ok());
  REQUIRE(rig.published.last > rig.published.first);
  CHECK(rig.published.last <= 4);
  unsigned layers = 0;
  for (std::uint32_t v = rig.published.first; v <= rig.published.last; ++v) {
    const Replicas::Replica* const part = rig.records.find_version(own, v, 0).part;
    REQUIRE(part != nullptr);
    const ChunkRecord record = rig.records.read(*part);
    CHECK(record.coded.size() <= kMostCodedBytes);
    CHECK(record.version.first == rig.published.first);
    CHECK((layers & record.version.layers) == 0);
    layers |= record.version.layers;
  }
  CHECK(layers == kAllLayers);
  OwnContent read(kRigComponents);
  REQUIRE(rig.records.read_block(own, *pack(kBlock), *read));
  OwnContent decoded(kRigComponents);
  REQUIRE(decode_block(coded(*content), kAllLayers, kRigComponents, *decoded) == Status::kOk);
  CHECK(picture_of(*read, kRigComponents) == picture_of(*decoded, kRigComponents));
}

TEST_CASE("RecordMaker: a block that is published again replaces all of its parts") {
  RecordsRig rig(7);
  HeldContribution& own = rig.open(kId);
  OwnContent content(kRigComponents);
  fill_beyond_datagram(*content);
  REQUIRE(rig.publish(own, kBlock, *content).ok());
  fill_voxel(*content, 8, 2.0F);
  REQUIRE(rig.publish(own, kBlock, *content).ok());
  CHECK(own.records == 1);
  OwnContent read(kRigComponents);
  REQUIRE(rig.records.read_block(own, *pack(kBlock), *read));
  CHECK(picture_of(*read, kRigComponents) == picture_of(*content, kRigComponents));
}

TEST_CASE("RecordMaker: an empty block is a record too, by which others forget what they have") {
  RecordsRig rig(7);
  HeldContribution& own = rig.open(kId);
  OwnContent content(kRigComponents);
  fill_voxel(*content, 8, 2.0F);
  REQUIRE(rig.publish(own, kBlock, *content).ok());
  content->clear();
  REQUIRE(rig.publish(own, kBlock, *content).ok());
  CHECK(own.records == 1);
  OwnContent read(kRigComponents);
  CHECK_FALSE(rig.records.read_block(own, *pack(kBlock), *read));
}

TEST_CASE("RecordMaker: without a version left nothing is published") {
  RecordsRig rig(7);
  HeldContribution& own = rig.open(kId);
  OwnContent content(kRigComponents);
  fill_voxel(*content, 8, 2.0F);
  own.latest = kLastVersion - 2;
  REQUIRE(rig.publish(own, kBlock, *content).ok());
  CHECK(own.latest == kLastVersion - 1);
  CHECK(rig.publish(own, kBlock, *content).status() == Status::kResourceExhausted);
  CHECK(rig.published.first > rig.published.last);
  CHECK(own.latest == kLastVersion - 1);
  CHECK(own.records == 1);
}

TEST_CASE("RecordMaker: parts before the one that has no room stay, and it is counted") {
  ReplicasConfig room = kRoomyReplicas;
  room.blocks = 1;
  RecordsRig rig(7, false, room);
  HeldContribution& own = rig.open(kId);
  OwnContent content(kRigComponents);
  fill_beyond_datagram(*content);
  CHECK(rig.publish(own, kBlock, *content).status() == Status::kResourceExhausted);
  CHECK(rig.published == VersionRange{1, 1});
  CHECK(own.latest == 1);
  CHECK(own.records == 1);
  CHECK(rig.counted.published_parts == 1);
  CHECK(rig.counted.refused_parts == 1);
}

TEST_CASE("RecordMaker: memory that is too small is refused") {
  AlignedMemory memory(RecordMaker::required_bytes() - 1);
  Arena arena = memory.arena();
  CHECK(RecordMaker::make(arena, {}, kRigComponents).status() == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
