// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The global map's records: which blocks are behind, and what a move waits for.
#include "tessera/fusion/internal/global_records.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "support/aligned_memory.hpp"

namespace tessera {
namespace {

struct OwnRecords {
  explicit OwnRecords(std::uint32_t blocks) : memory(GlobalRecords::required_bytes(blocks)) {
    Arena arena = memory.arena();
    records = *GlobalRecords::make(arena, blocks, 0);
  }
  AlignedMemory memory;
  GlobalRecords records;
};

GlobalRecords::BlockRange one(BlockCoord block) { return {block, block}; }

}  // namespace

TEST_CASE("GlobalRecords: a block has one record, and a closed one's place is used again") {
  OwnRecords own(2);
  GlobalRecords& records = own.records;
  REQUIRE(records.mark_sums(one({1, 2, 3}), UpdatePart::kUpdate));
  REQUIRE(records.mark_sums(one({-4, 0, 9}), UpdatePart::kUpdate));
  REQUIRE(records.mark_sums(one({1, 2, 3}), UpdatePart::kUpdate));
  CHECK(records.size() == 2);
  CHECK(records.waiting() == 2);
  const std::uint32_t number = records.find({1, 2, 3});
  REQUIRE(number != 0);
  CHECK(records.block_of(number) == BlockCoord{1, 2, 3});
  CHECK(records.find({1, 2, 4}) == 0);
  records.close(number);
  CHECK(records.find({1, 2, 3}) == 0);
  CHECK(records.waiting() == 1);
  REQUIRE(records.mark_sums(one({7, 7, 7}), UpdatePart::kUpdate));
  CHECK(records.size() == 2);
  CHECK(records.refused() == 0);
}

TEST_CASE(
    "GlobalRecords: where one block of a range has no place, it is counted and the others are "
    "marked") {
  OwnRecords own(3);
  GlobalRecords& records = own.records;
  CHECK_FALSE(records.mark_sums({{0, 0, 0}, {3, 0, 0}}, UpdatePart::kUpdate));
  CHECK(records.refused() == 1);
  CHECK(records.waiting() == 3);
  // Outside of the grid there is no place either.
  CHECK_FALSE(records.mark_sums(one({1 << 22, 0, 0}), UpdatePart::kUpdate));
  CHECK(records.refused() == 2);
}

TEST_CASE("GlobalRecords: sums are due before outputs, and the nearest blocks first") {
  OwnRecords own(8);
  GlobalRecords& records = own.records;
  records.set_focus(BlockCoord{0, 0, 0});
  REQUIRE(records.mark_sums(one({40, 0, 0}), UpdatePart::kUpdate));
  REQUIRE(records.mark_sums(one({1, 0, 0}), UpdatePart::kUpdate));
  const std::uint32_t near = records.find({1, 0, 0});
  const std::uint32_t far = records.find({40, 0, 0});
  CHECK(records.first() == near);
  records.take_off(near);
  CHECK(records.first() == far);
  // Outputs are of blocks of the graph alone.
  records.mark_outputs(one({1, 0, 0}), UpdatePart::kUpdate);
  CHECK(records.first() == far);
  records.at(near).sums.chain = 1;
  records.mark_outputs(one({1, 0, 0}), UpdatePart::kUpdate);
  CHECK(records.first() == near);
  CHECK(records.find_waiting_for_output({1, 0, 0}) == near);
  // Its sums are due too: they come first, and the output is not forgotten.
  records.mark(near, Agenda::kSums);
  CHECK(records.find_waiting_for_output({1, 0, 0}) == 0);
  CHECK(records.work_of(near) == Agenda::kSums);
  CHECK(records.at(near).output_due);
}

TEST_CASE("GlobalRecords: a move waits for what it marked, not for updates of what it moves") {
  OwnRecords own(8);
  GlobalRecords& records = own.records;
  REQUIRE(records.mark_sums({{0, 0, 0}, {1, 0, 0}}, UpdatePart::kMove));
  REQUIRE(records.mark_sums(one({2, 0, 0}), UpdatePart::kMovedUpdate));
  REQUIRE(records.mark_sums(one({3, 0, 0}), UpdatePart::kUpdate));
  CHECK(records.moving() == 2);
  const auto part = [&](std::int32_t x) { return records.at(records.find({x, 0, 0})).part(); };
  CHECK(part(0) == UpdatePart::kMove);
  CHECK(part(2) == UpdatePart::kMovedUpdate);
  CHECK(part(3) == UpdatePart::kUpdate);
  records.set_moved(records.at(records.find({0, 0, 0})));
  records.set_moved(records.at(records.find({0, 0, 0})));
  CHECK(records.moving() == 1);
  records.close(records.find({1, 0, 0}));
  CHECK(records.moving() == 0);
}

}  // namespace tessera
