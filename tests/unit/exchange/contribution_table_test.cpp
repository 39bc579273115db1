// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Who gets a place, who gives way, and floors of epochs.
#include "tessera/exchange/internal/contribution_table.hpp"

#include <catch2/catch.hpp>

#include "own_table.hpp"

namespace tessera {
namespace {

Statement statement_of(std::uint32_t epoch, std::uint64_t session) {
  Statement statement{.id = {1, epoch, 0}};
  statement.session = session;
  return statement;
}

}  // namespace

TEST_CASE(
    "ContributionTable: a robot has so many places, and its lowest gives way to a higher one") {
  OwnTable t;
  REQUIRE(t.add({7, 1, 0}, Claim::kFrame) != nullptr);
  REQUIRE(t.add({7, 1, 1}, Claim::kFrame) != nullptr);
  CHECK(t.add({7, 2, 0}, Claim::kName) == nullptr);  // a name takes nobody's place
  CHECK(t.add({7, 0, 9}, Claim::kFrame) == nullptr);
  CHECK(t.counted.refused_contributions == 2);
  CHECK(t.add({7, 2, 0}, Claim::kFrame) != nullptr);
  CHECK(t.counted.displaced_contributions == 1);
  CHECK(t.table.find({7, 1, 0}) == nullptr);
  CHECK(t.table.find({7, 1, 1}) != nullptr);
  CHECK_FALSE(t.replicas.find({7, 1, 0}).ok());  // and its slot is free
}

TEST_CASE("ContributionTable: map sessions have places of their own, and take nobody else's") {
  OwnTable t(false, 2, 30);
  const auto session = [](std::uint32_t epoch, std::uint32_t number) {
    return ContributionId{7, epoch, MapSession::kFirst + number};
  };
  REQUIRE(t.add({7, 1, 0}, Claim::kFrame) != nullptr);
  for (std::uint32_t i = 0; i < MapSession::kPlacesOfRobot; ++i)
    REQUIRE(t.add(session(1, i), Claim::kFrame) != nullptr);
  REQUIRE(t.add({7, 1, 1}, Claim::kFrame) != nullptr);
  CHECK(t.counted.displaced_contributions == 0);
  // One of a newer epoch takes the place of the lowest; an older one takes none.
  CHECK(t.add(session(0, 9), Claim::kFrame) == nullptr);
  CHECK(t.add(session(2, 0), Claim::kName) == nullptr);
  CHECK(t.add(session(2, 0), Claim::kFrame) != nullptr);
  CHECK(t.table.find(session(1, 0)) == nullptr);
  CHECK(t.table.find({7, 1, 0}) != nullptr);
  CHECK(t.table.find({7, 1, 1}) != nullptr);
}

TEST_CASE("EpochFloors: sessions have a floor of their own, which is at least that of all") {
  OwnTable t(true);
  CHECK(t.floors.of(ContributionId{7, 0, MapSession::kFirst}) == 0);
  CHECK(t.floors.note_sessions(7, 5, false, t.table));
  CHECK_FALSE(t.floors.note_sessions(7, 4, false, t.table));
  CHECK(t.floors.of(ContributionId{7, 0, MapSession::kFirst}) == 5);
  CHECK(t.floors.of(ContributionId{7, 0, 3}) == 0);
  CHECK(t.floors.note(7, 8, false, t.table));
  CHECK(t.floors.of_sessions(7) == 5);
  CHECK(t.floors.of(ContributionId{7, 0, MapSession::kFirst}) == 8);
  // This robot's own is what it says itself.
  CHECK_FALSE(t.floors.note_sessions(1, 9, true, t.table));
  t.floors.set_own_sessions(6);
  CHECK(t.floors.of(ContributionId{1, 0, MapSession::kFirst}) == 6);
}

TEST_CASE(
    "ContributionTable: a submap that a newer epoch has too gives way first, and stays away") {
  OwnTable t(false, 3);
  REQUIRE(t.add({7, 1, 0}, Claim::kFrame) != nullptr);
  REQUIRE(t.add({7, 1, 1}, Claim::kFrame) != nullptr);
  HeldContribution* const again = t.add({7, 2, 1}, Claim::kFrame);
  REQUIRE(again != nullptr);
  SECTION("once it is whole there") {
    again->stated = true;
    again->statement.frame_revision = 1;
    REQUIRE(again->complete());
    REQUIRE(t.add({7, 2, 2}, Claim::kFrame) != nullptr);
    CHECK(t.table.find({7, 1, 1}) == nullptr);
    CHECK(t.table.find({7, 1, 0}) != nullptr);
    CHECK_FALSE(t.table.would_displace({7, 1, 1}));
    CHECK(t.add({7, 1, 1}, Claim::kFrame) == nullptr);
    CHECK(t.counted.displaced_contributions == 1);
    REQUIRE(t.add({7, 2, 3}, Claim::kFrame) != nullptr);  // none is replaced: the lowest
    CHECK(t.table.find({7, 1, 0}) == nullptr);
  }
  SECTION("not before") {
    REQUIRE(t.add({7, 2, 2}, Claim::kFrame) != nullptr);
    CHECK(t.table.find({7, 1, 0}) == nullptr);
    CHECK(t.table.find({7, 1, 1}) != nullptr);
  }
}

TEST_CASE(
    "ContributionTable: a place is kept for this robot, and names give theirs to what is there") {
  OwnTable t;
  for (std::uint32_t robot = 2; robot < 6; ++robot)
    REQUIRE(t.add({robot, 1, 0}, Claim::kName) != nullptr);
  CHECK(t.add({6, 1, 0}, Claim::kName) == nullptr);
  CHECK(t.add({6, 1, 0}, Claim::kFrame) != nullptr);
  CHECK(t.counted.displaced_contributions == 1);
  HeldContribution* const own = t.add({1, 1, 0}, Claim::kOwn);
  REQUIRE(own != nullptr);
  t.table.publish_as(*own);
  CHECK(t.table.publishing() == own);
  t.table.drop(*own);
  CHECK(t.table.publishing() == nullptr);
}

TEST_CASE(
    "ContributionTable: of silent robots the one with the fewest records gives way, to who is "
    "here") {
  OwnTable t;
  for (std::uint32_t robot = 2; robot < 6; ++robot) {
    HeldContribution* const place = t.add({robot, 1, 0}, Claim::kPresent);
    REQUIRE(place != nullptr);
    place->records = robot;
    place->origin_at = Instant::at_us(1'000'000);
  }
  t.table.find({2, 1, 0})->origin_at = Instant::at_us(20'000'000);
  constexpr std::int64_t kLater_us = 20'000'000;
  CHECK(t.add({8, 1, 0}, Claim::kFrame, kLater_us) == nullptr);
  CHECK(t.add({8, 1, 0}, Claim::kPresent, kLater_us) != nullptr);
  CHECK(t.table.find({2, 1, 0}) != nullptr);  // heard lately
  CHECK(t.table.find({3, 1, 0}) == nullptr);
}

TEST_CASE("ContributionTable: names for which nothing came are dropped after ten seconds") {
  OwnTable t;
  t.add({2, 1, 0}, Claim::kName, 1'000'000);
  t.add({3, 1, 0}, Claim::kFrame, 1'000'000);
  t.table.drop_empty_names(Instant::at_us(11'000'000));
  CHECK(t.table.find({2, 1, 0}) != nullptr);
  t.table.drop_empty_names(Instant::at_us(11'000'001));
  CHECK(t.table.find({2, 1, 0}) == nullptr);
  CHECK(t.table.find({3, 1, 0}) != nullptr);
}

TEST_CASE(
    "ContributionTable: what a robot leaves out twice of its list is dropped, once is not enough") {
  OwnTable t;
  const auto second = [](std::int64_t s) { return Instant::at_us(s * 1'000'000); };
  HeldContribution* const listed = t.add({2, 5, 0}, Claim::kFrame);
  t.add({2, 6, 0}, Claim::kFrame);
  listed->listed = second(2);
  CHECK(t.table.drop_unlisted(2, 5, second(2)) == 0);
  listed->listed = second(3);
  CHECK(t.table.drop_unlisted(2, 5, second(3)) == 1);
  CHECK(t.table.find({2, 5, 0}) != nullptr);
  CHECK(t.table.find({2, 6, 0}) == nullptr);
}

TEST_CASE(
    "ContributionTable: the digest does not depend on the order in which contributions came") {
  OwnTable a;
  OwnTable b;
  a.add({2, 1, 0}, Claim::kFrame);
  a.add({3, 1, 0}, Claim::kFrame);
  b.add({3, 1, 0}, Claim::kFrame);
  b.add({2, 1, 0}, Claim::kFrame);
  CHECK(a.table.digest() == b.table.digest());
  a.table.find({2, 1, 0})->held.low = 1;
  CHECK(a.table.digest() != b.table.digest());
}

TEST_CASE(
    "EpochFloors: floors only rise, but for who may say so, and a robot without data gives its "
    "place") {
  OwnTable t;
  CHECK(t.floors.note(7, 3, false, t.table));
  CHECK_FALSE(t.floors.note(7, 2, false, t.table));
  CHECK(t.floors.of(7) == 3);
  CHECK(t.floors.note(7, 2, true, t.table));
  CHECK(t.floors.of(7) == 2);
  CHECK_FALSE(t.floors.note(1, 9, true, t.table));  // this robot's own
  // Three places: of peers and one.
  t.add({7, 2, 0}, Claim::kFrame);
  CHECK(t.floors.note(8, 1, false, t.table));
  CHECK(t.floors.note(9, 1, false, t.table));
  CHECK(t.floors.note(10, 4, false, t.table));
  CHECK(t.floors.of(7) == 2);
  CHECK(t.floors.of(8) == 0);
  CHECK(t.floors.of(10) == 4);
}

TEST_CASE(
    "EpochFloors: what another process states of this robot's epochs is noted, its own is not") {
  const bool signs = GENERATE(false, true);
  OwnTable t(signs);
  HeldContribution* const own = t.add({1, 5, 0}, Claim::kOwn);
  t.table.publish_as(*own);
  t.floors.claim(5);
  own->latest = 10;
  constexpr std::uint64_t kSession = 77;
  const auto heard = [&](const Statement& statement) {
    return t.floors.note_statement(statement, kSession, t.table.find(statement.id), own);
  };
  Statement mine = statement_of(5, kSession);
  mine.latest = 10;
  CHECK_FALSE(heard(mine));
  CHECK_FALSE(heard(statement_of(4, kSession - 1)));  // a process before it
  CHECK(t.floors.highest_session() == kSession - 1);
  CHECK_FALSE(t.floors.overtaken());
  CHECK(heard(statement_of(5, kSession + 1)));
  CHECK(*t.floors.overtaken() == 5);
  // Far ahead: only a signature makes it true.
  CHECK(heard(statement_of(0x7fffffff, kSession + 1)) == signs);
  t.floors.begin(6);
  CHECK(t.floors.overtaken().has_value() == signs);
}

TEST_CASE("EpochFloors: three claims of others are followed at once, then one in 20 s") {
  OwnTable t(true);
  HeldContribution* const own = t.add({1, 5, 0}, Claim::kOwn);
  t.table.publish_as(*own);
  Instant now = Instant::at_us(1'000'000);
  const auto reopen = [&] {
    own->id.epoch = *t.floors.overtaken() + 1;
    t.floors.begin(own->id.epoch);
  };
  t.floors.note_claim(5, own, now);
  CHECK_FALSE(t.floors.overtaken());
  // Of several that come before an epoch is begun the highest counts.
  for (std::uint32_t floor = 6; floor < 20; ++floor) t.floors.note_claim(floor, own, now);
  CHECK(*t.floors.overtaken() == 19);
  reopen();
  for (const std::uint32_t floor : {30U, 40U}) {
    t.floors.note_claim(floor, own, now);
    CHECK(*t.floors.overtaken() == floor);
    reopen();
  }
  t.floors.note_claim(1000, own, now + Duration{19'000'000});
  CHECK_FALSE(t.floors.overtaken());
  t.floors.note_claim(1000, own, now + Duration{20'000'000});
  CHECK(*t.floors.overtaken() == 1000);
}

}  // namespace tessera
