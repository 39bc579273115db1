// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places of the table under random use: which are used, which are free, and who gives way.
#include <algorithm>
#include <optional>
#include <vector>

#include "own_table.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"

namespace tessera {
namespace {

/// What is held of all, by comparing each with each.
std::optional<ContributionId> lowest_replaced(const std::vector<HeldContribution*>& all,
                                              const ContributionId& id, bool& is_it) {
  const auto is_replaced = [&](const ContributionId& one) {
    return std::any_of(all.begin(), all.end(), [&](const HeldContribution* other) {
      return other->open && other->complete() && other->id.robot == one.robot &&
             other->id.submap == one.submap && other->id.epoch > one.epoch;
    });
  };
  is_it = is_replaced(id);
  std::optional<ContributionId> lowest;
  for (const HeldContribution* one : all) {
    const bool counts = one->open && !one->own && one->id.robot == id.robot;
    if (counts && is_replaced(one->id) && (!lowest || one->id < *lowest)) lowest = one->id;
  }
  return lowest;
}

/// The one that gives way to id, if its robot has all of its places; refused: none does.
std::optional<ContributionId> giving_way(const std::vector<HeldContribution*>& all,
                                         const ContributionId& id, std::size_t most,
                                         bool& refused) {
  const HeldContribution* lowest = nullptr;
  std::size_t count = 0;
  for (const HeldContribution* one : all) {
    if (one->own || one->id.robot != id.robot) continue;
    ++count;
    if (lowest == nullptr || (one->open == lowest->open ? one->id < lowest->id : !one->open))
      lowest = one;
  }
  refused = false;
  if (count < most) return std::nullopt;
  bool is_it = false;
  const std::optional<ContributionId> replaced = lowest_replaced(all, id, is_it);
  refused = lowest->open && (is_it ? !replaced || id < *replaced : !replaced && id < lowest->id);
  return replaced && lowest->open ? *replaced : lowest->id;
}

TEST_CASE("ContributionTable: places and who gives way are as counting and comparing all says") {
  oracle::Random random(oracle::announce_seed(640));
  constexpr std::uint32_t kPlaces = 24;
  constexpr std::size_t kOfOne = 7;
  OwnTable t(false, kOfOne, kPlaces);
  const auto used = [&] {
    std::vector<HeldContribution*> all;
    for (HeldContribution& one : t.table.places())
      if (one.used) all.push_back(&one);
    return all;
  };
  int displaced = 0;
  for (int round = 0; round < 4000; ++round) {
    const auto pick = [&](int below) { return static_cast<std::uint32_t>(random.below(below)); };
    const ContributionId id{1 + pick(4), 1 + pick(5), pick(6)};
    std::vector<HeldContribution*> before = used();
    REQUIRE((t.table.places().empty() || t.table.places().back().used));
    const auto own =
        std::count_if(before.begin(), before.end(), [](const auto* one) { return one->own; });
    REQUIRE(t.table.free_places() ==
            kPlaces - before.size() - std::min<std::size_t>(kPlaces - before.size(), own == 0));
    if (HeldContribution* const known = t.table.find(id); known != nullptr) {
      switch (random.below(4)) {
        case 0:
          if (!known->own) t.table.drop(*known);
          break;
        case 1:
          known->stated = known->open;
          break;
        default:
          known->statement.records = pick(2);
          break;
      }
      continue;
    }
    if (own == 0 && id.robot == 1 && random.below(3) == 0) {
      HeldContribution* const mine = t.add(id, Claim::kOwn);
      REQUIRE(mine != nullptr);
      t.table.publish_as(*mine);
      continue;
    }
    bool refused = false;
    const std::optional<ContributionId> gone = giving_way(before, id, kOfOne, refused);
    REQUIRE(t.table.would_displace(id) == (gone && !refused));
    const bool is_name = random.below(4) == 0;
    const std::uint32_t free = t.table.free_places();
    const HeldContribution* const place = t.add(id, is_name ? Claim::kName : Claim::kFrame);
    if (gone) {
      REQUIRE((place != nullptr) == (!refused && !is_name));
      if (place != nullptr) CHECK(t.table.find(*gone) == nullptr);
      displaced += place != nullptr ? 1 : 0;
    } else if (free != 0) {
      REQUIRE(place != nullptr);
      REQUIRE(used().size() == before.size() + 1);
    }
  }
  CHECK(displaced > 100);
}

TEST_CASE(
    "ContributionTable: what a robot has without blocks takes no place of its maps, here or "
    "there") {
  const std::uint32_t kind = GENERATE(Objection::kNumber, FrameStatements::kNumber);
  const std::uint32_t other = Objection::kNumber + FrameStatements::kNumber - kind;
  constexpr std::uint32_t kPlaces = 8;
  constexpr std::size_t kOfOne = 3;
  OwnTable t(false, kOfOne, kPlaces);
  for (std::uint32_t submap = 0; submap < kOfOne; ++submap)
    REQUIRE(t.add({7, 1, submap}, Claim::kFrame) != nullptr);
  for (const std::uint32_t epoch : {1U, 2U, 3U, 4U}) {
    REQUIRE(t.add({7, epoch, kind}, Claim::kFrame) != nullptr);
    for (std::uint32_t submap = 0; submap < kOfOne; ++submap)
      CHECK(t.table.find({7, 1, submap}) != nullptr);
  }
  CHECK(t.add({7, 1, other}, Claim::kFrame) != nullptr);
  CHECK(t.table.find({7, 3, kind}) != nullptr);
  // Those of the newest epochs.
  CHECK(t.table.find({7, 2, kind}) == nullptr);
  CHECK(t.table.find({7, 3, kind}) != nullptr);
  CHECK(t.table.find({7, 4, kind}) != nullptr);
  // The place that is kept for this robot's own map is not theirs.
  for (std::uint32_t robot = 20; t.table.free_places() != 0; ++robot)
    REQUIRE(t.add({robot, 1, 0}, Claim::kFrame) != nullptr);
  CHECK(t.add({1, 1, kind}, Claim::kOwn) == nullptr);
  CHECK(t.add({1, 1, 0}, Claim::kOwn) != nullptr);
}

TEST_CASE("ContributionTable: a robot holds those of its own without blocks that others hold") {
  const std::uint32_t kind = GENERATE(Objection::kNumber, FrameStatements::kNumber);
  OwnTable mine(false, 3, 12);
  OwnTable theirs(false, 3, 12);
  const auto id = [=](std::uint32_t epoch) { return ContributionId{1, epoch, kind}; };
  const auto own = [&](std::uint32_t epoch) {
    HeldContribution* const added = mine.add(id(epoch), Claim::kOwn);
    REQUIRE(added != nullptr);
    REQUIRE(mine.table.set_frame(*added, Matrix34d::Identity(), 1) == Status::kOk);
    mine.table.own_as(*added);
  };
  const auto are_alike = [&] {
    for (std::uint32_t epoch = 1; epoch <= 5; ++epoch) {
      CAPTURE(epoch);
      CHECK((mine.table.find(id(epoch)) != nullptr) == (theirs.table.find(id(epoch)) != nullptr));
    }
  };
  for (const std::uint32_t epoch : {1U, 2U, 3U, 4U}) theirs.add(id(epoch), Claim::kFrame);
  SECTION("of earlier starts that it hears first") {
    for (const std::uint32_t epoch : {1U, 2U, 3U}) mine.add(id(epoch), Claim::kFrame);
    own(4);
    are_alike();
  }
  SECTION("of earlier starts that it hears later, in any order") {
    own(4);
    for (const std::uint32_t epoch : {1U, 3U, 2U}) mine.add(id(epoch), Claim::kFrame);
    are_alike();
    // Once its own are gone there is room again.
    mine.table.drop(*mine.table.find(id(4)));
    CHECK(mine.add(id(2), Claim::kFrame) != nullptr);
    CHECK(mine.table.find(id(3)) != nullptr);
  }
  SECTION("of epochs of the same process") {
    for (const std::uint32_t epoch : {1U, 2U, 3U, 4U}) own(epoch);
    are_alike();
  }
}

TEST_CASE(
    "ContributionTable: without blocks, and of a process that is gone, nobody lacks what nobody "
    "has") {
  const std::uint32_t kind = GENERATE(Objection::kNumber, FrameStatements::kNumber);
  OwnTable t(false, 3, 12);
  const auto opened = [&](const ContributionId& id) -> HeldContribution& {
    HeldContribution* const added = t.add(id, Claim::kFrame);
    REQUIRE(added != nullptr);
    return *added;
  };
  // Its statement never came, or says more than was ever received.
  HeldContribution& one = opened({7, 2, kind});
  HeldContribution& map = opened({7, 2, 0});
  CHECK_FALSE(t.table.lacks_nothing(one));
  opened({8, 3, 0});  // another robot's
  opened({7, 1, 0});  // an earlier epoch
  REQUIRE(t.add({7, 3, 1}, Claim::kName) != nullptr);
  CHECK_FALSE(t.table.lacks_nothing(one));
  opened({7, 3, 0});
  CHECK(t.table.lacks_nothing(one));
  CHECK_FALSE(t.table.lacks_nothing(map));
}

}  // namespace
}  // namespace tessera
