// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Records of chunks: which are taken, what they change, and what is none of their origin's.
#include "tessera/exchange/internal/chunk_taker.hpp"

#include <catch2/catch.hpp>

#include "records_rig.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera {
namespace {

constexpr ContributionId kId{7, 1, 0};

/// The robot that publishes, with blocks in a row, and one that hears it.
struct Pair {
  explicit Pair(bool signs = false, const ReplicasConfig& room = kRoomyReplicas)
      : origin(kId.robot, signs), hearer(2, signs, room) {
    own = &origin.open(kId);
    held = &hearer.open(kId);
    OwnContent content(kRigComponents);
    for (int i = 0; i < kBlocks; ++i) {
      fill_voxel(*content, 8 + i, 2.0F);
      REQUIRE(origin.publish(*own, {i, 0, 0}, *content).ok());
    }
  }
  static constexpr int kBlocks = 3;
  static constexpr VersionRange kAll{1, kBlocks};

  RecordsRig origin;
  RecordsRig hearer;
  HeldContribution* own = nullptr;
  HeldContribution* held = nullptr;
};

bool holds_the_same(const HeldContribution& a, const HeldContribution& b) {
  return a.records == b.records && a.held == b.held;
}

TEST_CASE("ChunkTaker: what is new is taken, and again it is stale") {
  const bool signs = GENERATE(false, true);
  Pair pair(signs);
  const ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  const std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  const ChunkTaker::Taken taken = pair.hearer.take(*pair.held, header, body);
  CHECK(taken.well_formed);
  CHECK(taken.grew);
  CHECK(taken.records == 3);
  CHECK_FALSE(taken.refused);
  CHECK_FALSE(taken.forged);
  CHECK(holds_the_same(*pair.held, *pair.own));
  CHECK(pair.held->coverage.contains(Pair::kAll));
  CHECK(pair.hearer.counted.records_taken == 3);
  const ChunkTaker::Taken again = pair.hearer.take(*pair.held, header, body);
  CHECK_FALSE(again.grew);
  CHECK(again.records == 0);
  CHECK(pair.hearer.counted.records_stale == 3);
}

TEST_CASE("ChunkTaker: versions that a chunk leaves out are no more, but for a partial one") {
  Pair pair;
  const bool partial = GENERATE(false, true);
  ChunkHeader header = RecordsRig::header_of(*pair.own, {1, 2});
  const std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  header.range.last = 9;
  header.partial = partial;
  CHECK(pair.hearer.take(*pair.held, header, body).records == 2);
  CHECK(pair.held->coverage.contains({3, 9}) != partial);
}

TEST_CASE("ChunkTaker: of a chunk that breaks off what comes before that is taken") {
  Pair pair;
  const ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  body.pop_back();
  const ChunkTaker::Taken taken = pair.hearer.take(*pair.held, header, body);
  CHECK_FALSE(taken.well_formed);
  CHECK(taken.records == 2);
  // Nothing is known of the rest.
  CHECK_FALSE(pair.held->coverage.contains({3, 3}));
}

TEST_CASE("ChunkTaker: what has no room is counted and stays a gap") {
  ReplicasConfig room = kRoomyReplicas;
  room.blocks = 2;
  Pair pair(false, room);
  const ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  const std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  const ChunkTaker::Taken taken = pair.hearer.take(*pair.held, header, body);
  CHECK(taken.well_formed);
  CHECK(taken.refused);
  CHECK(taken.records == 2);
  CHECK(pair.hearer.counted.records_refused == 1);
  CHECK(pair.held->coverage.contains({1, 2}));
  CHECK_FALSE(pair.held->coverage.contains({3, 3}));
}

TEST_CASE("ChunkTaker: of an awaited chunk it says how many records are the latest here") {
  Pair pair;
  const ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  const std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  CHECK(pair.hearer.take(*pair.held, header, body).held == 0);
  CHECK(pair.hearer.take(*pair.held, header, body, true).held == 3);
  // Of a block that has a later version by now the one of the chunk is none.
  OwnContent content(kRigComponents);
  fill_voxel(*content, 100, 2.0F);
  REQUIRE(pair.origin.publish(*pair.own, {0, 0, 0}, *content).ok());
  const ChunkHeader later = RecordsRig::header_of(*pair.own, {4, 4});
  REQUIRE(pair.hearer.take(*pair.held, later, pair.origin.body_of(*pair.own, later)).records == 1);
  CHECK(pair.hearer.take(*pair.held, header, body, true).held == 2);
}

TEST_CASE("ChunkTaker: two contents of a version are a conflict, and order does not matter") {
  Pair pair;
  RecordsRig twin(kId.robot);
  HeldContribution& of_twin = twin.open(kId);
  OwnContent content(kRigComponents);
  fill_voxel(*content, 300, 2.0F);
  REQUIRE(twin.publish(of_twin, {0, 0, 0}, *content).ok());
  const ChunkHeader one = RecordsRig::header_of(*pair.own, {1, 1});
  const ChunkHeader two = RecordsRig::header_of(of_twin, {1, 1});
  const std::vector<std::byte> body_of_one = pair.origin.body_of(*pair.own, one);
  const std::vector<std::byte> body_of_two = twin.body_of(of_twin, two);
  static_cast<void>(pair.hearer.take(*pair.held, one, body_of_one));
  static_cast<void>(pair.hearer.take(*pair.held, two, body_of_two));
  RecordsRig other(3);
  HeldContribution& held = other.open(kId);
  static_cast<void>(other.take(held, two, body_of_two));
  static_cast<void>(other.take(held, one, body_of_one));
  CHECK(holds_the_same(*pair.held, held));
  // Only where the second one replaces the first.
  CHECK(pair.hearer.counted.conflicts + other.counted.conflicts == 1);
}

TEST_CASE("ChunkTaker: in a fleet that signs nothing is taken of what its origin did not sign") {
  Pair pair(true);
  const ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  SECTION("another signature") { body.back() ^= std::byte{1}; }
  SECTION("another record") { body[body.size() - kSignatureBytes - 1] ^= std::byte{1}; }
  const ChunkTaker::Taken taken = pair.hearer.take(*pair.held, header, body);
  CHECK((taken.forged || !taken.well_formed));
  CHECK(pair.held->records == 0);
  CHECK(pair.hearer.counted.records_taken == 0);
}

TEST_CASE("ChunkTaker: a chunk too short for a signature is none") {
  Pair pair(true);
  const ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  const std::vector<std::byte> body(kSignatureBytes - 1);
  CHECK_FALSE(pair.hearer.take(*pair.held, header, body).well_formed);
}

TEST_CASE("ChunkTaker: a signature is checked once for a chunk, and not where nothing is new") {
  Pair pair(true);
  const ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  const std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  REQUIRE(pair.hearer.take(*pair.held, header, body).records == 3);
  CHECK(pair.hearer.toy.checks() == 1);
  pair.held->stated = true;
  pair.held->statement = header.statement;
  REQUIRE(pair.hearer.take(*pair.held, header, body).well_formed);
  CHECK(pair.hearer.toy.checks() == 1);
}

TEST_CASE("ChunkTaker: what a robot took it can pass on, and a third one believes the proofs") {
  Pair pair(true);
  ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  REQUIRE(pair.hearer.take(*pair.held, header, pair.origin.body_of(*pair.own, header)).records ==
          3);
  CHECK_FALSE(pair.hearer.taker.statement_proof().empty());
  header.relayed = true;
  std::vector<std::byte> relayed = pair.hearer.body_of(*pair.held, header);
  RecordsRig third(3, true);
  HeldContribution& held = third.open(kId);
  SECTION("as it was") {
    CHECK(third.take(held, header, relayed).records == 3);
    CHECK(holds_the_same(held, *pair.own));
  }
  SECTION("with one bit of the last code or proof changed") {
    relayed.back() ^= std::byte{1};
    const ChunkTaker::Taken taken = third.take(held, header, relayed);
    CHECK((taken.forged || !taken.well_formed));
    CHECK(taken.records == 2);
  }
}

TEST_CASE("ChunkTaker: of its own contribution a robot knows what it made itself") {
  Pair pair;
  ChunkHeader header = RecordsRig::header_of(*pair.own, Pair::kAll);
  header.relayed = true;
  const std::vector<std::byte> body = pair.origin.body_of(*pair.own, header);
  const auto check = [&](RecordsRig& by, const HeldContribution& own) {
    return by.taker.check_own(by.records, own, header, body, true);
  };
  REQUIRE(check(pair.origin, *pair.own).has_value());
  CHECK(*check(pair.origin, *pair.own) == 3);
  // Another process of the same number did not make these.
  RecordsRig twin(kId.robot);
  CHECK_FALSE(check(twin, twin.open(kId)).has_value());
}

TEST_CASE("ChunkTaker: what is stated about frames is taken as it is, and as its author's alone") {
  constexpr ContributionId kFrames{7, 1, FrameStatements::kNumber};
  RecordsRig origin(kFrames.robot);
  RecordsRig hearer(2);
  HeldContribution& own = origin.open(kFrames);
  HeldContribution& held = hearer.open(kFrames);
  FrameLink link;
  link.from = 7;
  link.from_epoch = 1;
  link.to = 9;
  link.revision = 1;
  BlockKey place = place_of_link(9);
  bool is_good = false;
  SECTION("as it should be") { is_good = true; }
  SECTION("of another robot") { link.from = 8; }
  SECTION("of another epoch") { link.from_epoch = 2; }
  SECTION("in the place of another one") { place = place_of_link(10); }
  SECTION("in the place of the prior") { place = kPlaceOfPrior; }
  std::array<std::byte, FrameLink::kBytes> bytes{};
  REQUIRE(encode_link(link, bytes) == Status::kOk);
  REQUIRE(origin.maker
              .publish_bytes({origin.table, origin.records, *origin.scratch, origin.counted}, own,
                             place, bytes)
              .ok());
  const ChunkHeader header = RecordsRig::header_of(own, {1, 1});
  const ChunkTaker::Taken taken = hearer.take(held, header, origin.body_of(own, header));
  CHECK(taken.well_formed == is_good);
  CHECK(taken.records == (is_good ? 1U : 0U));
  CHECK(holds_the_same(held, own) == is_good);
}

TEST_CASE("ChunkTaker: memory that is too small is refused") {
  AlignedMemory memory(ChunkTaker::required_bytes() - 1);
  Arena arena = memory.arena();
  CHECK(ChunkTaker::make(arena, {}, 1, kRigComponents).status() == Status::kResourceExhausted);
}

}  // namespace
}  // namespace tessera
