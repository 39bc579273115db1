// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Records in the store, in their contribution's index, and in its fingerprint and number.
#include "tessera/exchange/internal/held_records.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "records_rig.hpp"

namespace tessera {
namespace {

constexpr ContributionId kId{7, 1, 0};

/// A record of one block, as it would arrive.
struct Arriving {
  Arriving(const RecordsRig& rig, BlockCoord at, std::uint32_t number, float count)
      : content(kRigComponents), block(at) {
    fill_voxel(*content, 3, count);
    code = coded(*content);
    version = {.number = number, .first = number};
    version.hash = record_hash(
        leaf_of(rig.signatures, kId, {.block = block, .version = version, .coded = code}));
  }
  Result<Replicas::Change> put(RecordsRig& rig, HeldContribution& into,
                               std::span<const std::byte> proof = {}) {
    return rig.records.put(rig.table, into, key(), version, *content, code, proof);
  }
  [[nodiscard]] BlockKey key() const { return *pack(block); }

  OwnContent content;
  BlockCoord block;
  CodedBytes code;
  PartVersion version;
};

TEST_CASE("HeldRecords: a contribution counts what it holds, and a later version replaces one") {
  RecordsRig rig(1);
  HeldContribution& held = rig.open(kId);
  Arriving first(rig, {1, 2, 3}, 1, 2.0F);
  Arriving other(rig, {4, 5, 6}, 2, 2.0F);
  REQUIRE(first.put(rig, held).ok());
  const Fingerprint one = held.held;
  REQUIRE(other.put(rig, held).ok());
  CHECK(held.records == 2);
  CHECK(held.record_bytes == first.code.size() + other.code.size());
  CHECK(rig.table.held_bytes() == held.record_bytes);
  Arriving later(rig, {1, 2, 3}, 3, 5.0F);
  CHECK(rig.records.is_news(held, later.key(), later.version));
  REQUIRE(later.put(rig, held).ok());
  CHECK(held.records == 2);
  CHECK_FALSE(held.held == one);
  CHECK_FALSE(rig.records.is_news(held, first.key(), first.version));
  // What came too late changes nothing.
  const Fingerprint before = held.held;
  CHECK(*first.put(rig, held) == Replicas::Change::kStale);
  CHECK(held.held == before);
  CHECK(held.records == 2);
}

TEST_CASE("HeldRecords: the fingerprint does not depend on the order in which records came") {
  RecordsRig a(1);
  RecordsRig b(2);
  HeldContribution& here = a.open(kId);
  HeldContribution& there = b.open(kId);
  for (int i = 0; i < 6; ++i) {
    const int other = 5 - i;
    Arriving forth(a, {i % 4, 0, 0}, static_cast<std::uint32_t>(1 + i), 1.0F);
    Arriving back(b, {other % 4, 0, 0}, static_cast<std::uint32_t>(1 + other), 1.0F);
    REQUIRE(forth.put(a, here).ok());
    REQUIRE(back.put(b, there).ok());
  }
  CHECK(here.records == 4);
  CHECK(here.held == there.held);
}

TEST_CASE("HeldRecords: a record is read as it came, with its proof where the fleet signs") {
  const bool signs = GENERATE(false, true);
  RecordsRig rig(1, signs);
  HeldContribution& held = rig.open(kId);
  Arriving record(rig, {1, 2, 3}, 9, 2.0F);
  const std::vector<std::byte> proof(1 + kSignatureBytes, std::byte{5});
  REQUIRE(record.put(rig, held, signs ? proof : std::span<const std::byte>{}).ok());
  CHECK(rig.records.taken_bytes() == record.code.size() + (signs ? 1 + proof.size() : 0));
  const Replicas::Replica* const part = rig.records.find_version(held, 9, 0).part;
  REQUIRE(part != nullptr);
  const ChunkRecord read = rig.records.read(*part);
  CHECK(read.block == record.block);
  CHECK(read.version.number == 9);
  CHECK(read.version.hash == record.version.hash);
  CHECK(std::equal(read.coded.begin(), read.coded.end(), record.code.begin(), record.code.end()));
  CHECK(read.proof.size() == (signs ? proof.size() : 0));
  CHECK(std::equal(read.proof.begin(), read.proof.end(), proof.begin()));
}

TEST_CASE("HeldRecords: the content of a block is what was put, and of an unknown one nothing") {
  RecordsRig rig(1);
  HeldContribution& held = rig.open(kId);
  Arriving record(rig, {1, 2, 3}, 1, 2.0F);
  REQUIRE(record.put(rig, held).ok());
  OwnContent read(kRigComponents);
  CHECK(rig.records.read_block(held, record.key(), *read));
  CHECK(picture_of(*read, kRigComponents) == picture_of(*record.content, kRigComponents));
  OwnContent nothing(kRigComponents);
  CHECK_FALSE(rig.records.read_block(held, *pack({9, 9, 9}), *nothing));
}

TEST_CASE("HeldRecords: two contents of one version contradict each other, in any block") {
  RecordsRig rig(1);
  HeldContribution& held = rig.open(kId);
  Arriving record(rig, {1, 2, 3}, 5, 2.0F);
  Arriving same_block(rig, {1, 2, 3}, 5, 3.0F);
  Arriving other_block(rig, {6, 6, 6}, 5, 2.0F);
  REQUIRE(record.put(rig, held).ok());
  CHECK(rig.records.find(held, record.key(), 5, record.version.hash) != nullptr);
  CHECK(rig.records.find(held, record.key(), 5, same_block.version.hash) == nullptr);
  CHECK(rig.records.contradicted(held, record.key(), record.version) == nullptr);
  CHECK(rig.records.contradicted(held, record.key(), same_block.version) != nullptr);
  CHECK(rig.records.contradicted(held, other_block.key(), other_block.version) == nullptr);
  CHECK(rig.records.of_other_block(held, other_block.version) != nullptr);
  CHECK(rig.records.of_other_block(held, record.version) == nullptr);
}

TEST_CASE("HeldRecords: of a version that was given twice each record has a place") {
  RecordsRig rig(1);
  HeldContribution& held = rig.open(kId);
  for (int i = 0; i < 3; ++i) {
    Arriving record(rig, {i, 0, 0}, 5, 2.0F);
    REQUIRE(record.put(rig, held).ok());
  }
  std::vector<std::uint64_t> keys;
  for (std::uint32_t place = 0; place < 3; ++place) {
    const HeldRecords::OfVersion found = rig.records.find_version(held, 5, place);
    REQUIRE(found.part != nullptr);
    CHECK(found.count == 3);
    keys.push_back(found.part->key);
  }
  std::sort(keys.begin(), keys.end());
  CHECK(std::unique(keys.begin(), keys.end()) == keys.end());
  CHECK(rig.records.find_version(held, 5, 3).part == nullptr);
  CHECK(rig.records.find_version(held, 4, 0).count == 0);
}

TEST_CASE("HeldRecords: who sent as many records of a range as there are has sent all of it") {
  RecordsRig rig(1);
  HeldContribution& held = rig.open(kId);
  for (std::uint32_t v = 1; v <= 4; ++v) {
    Arriving record(rig, {static_cast<int>(v), 0, 0}, v, 2.0F);
    REQUIRE(record.put(rig, held).ok());
  }
  CHECK(rig.records.is_all_of(held, {2, 3}, 2));
  CHECK_FALSE(rig.records.is_all_of(held, {2, 4}, 2));
  CHECK(rig.records.is_all_of(held, {5, 9}, 0));
}

TEST_CASE("HeldRecords: a record without room is refused, and all stays as it was") {
  ReplicasConfig room = kRoomyReplicas;
  room.blocks = 1;
  RecordsRig rig(1, false, room);
  HeldContribution& held = rig.open(kId);
  Arriving first(rig, {1, 2, 3}, 1, 2.0F);
  Arriving second(rig, {4, 5, 6}, 2, 2.0F);
  REQUIRE(first.put(rig, held).ok());
  const Fingerprint before = held.held;
  const std::uint64_t taken = rig.records.taken_bytes();
  CHECK(second.put(rig, held).status() == Status::kResourceExhausted);
  CHECK(held.records == 1);
  CHECK(held.held == before);
  CHECK(rig.records.taken_bytes() == taken);
}

TEST_CASE("HeldRecords: memory that is too small is refused") {
  const ExchangeConfig config = RecordsRig::config(kRoomyReplicas);
  AlignedMemory memory(HeldRecords::required_bytes(config, kRigComponents) - 1);
  Arena arena = memory.arena();
  CHECK(HeldRecords::make(arena, config, {}, false, kRigComponents).status() ==
        Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
